"""Shapes of poses and reviews in REST."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from app.reviews.service import ReviewedPose
from app.tables.imagery import Image
from app.tables.reviews import Grade, Review

Reason = Annotated[str, Field(max_length=32)]
Pixels = list[list[float] | None]
PREVIEW_WIDTH_PX = 1280


class ReviewIn(BaseModel):
    """A person's verdict on a pose."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {"grade": "ok", "reasons": ["heading"], "comment": None, "seconds": 1.8},
            ]
        },
    )

    grade: Grade
    reasons: Annotated[list[Reason], Field(max_length=10)] = []
    comment: Annotated[str | None, Field(max_length=4000, pattern=r"^[^\x00]*$")] = None
    seconds: Annotated[
        float | None, Field(ge=0, le=86400, allow_inf_nan=False, description="Time it took")
    ] = None


class ReviewOut(BaseModel):
    """A verdict as it was stored."""

    id: int
    pose_id: int
    grade: Grade
    reasons: list[str]
    comment: str | None
    seconds: float | None
    guideline_version: int
    inherited: bool
    user: str | None
    created_at: datetime
    replaced_at: datetime | None

    @classmethod
    def of(cls, review: Review, user: str | None = None) -> "ReviewOut":
        """Take the columns of a review."""
        return cls(
            id=review.id,
            pose_id=review.pose_id,
            grade=review.grade,
            reasons=review.reasons,
            comment=review.comment,
            seconds=review.seconds,
            guideline_version=review.guideline_version,
            inherited=review.inherited_from_id is not None,
            user=user or (review.user.name or review.user.email if review.user else None),
            created_at=review.created_at,
            replaced_at=review.replaced_at,
        )


class PoseImage(BaseModel):
    """The photograph of a pose."""

    id: int
    file_url: str
    preview_url: str
    width_px: int
    height_px: int
    captured_at: datetime
    file_name: str
    sha256: str

    @classmethod
    def of(cls, image: Image) -> "PoseImage":
        """Give an image's addresses; they name the content, so they may be kept for ever."""
        base, version = f"/api/v1/images/{image.id}", image.sha256[:12]
        return cls(
            id=image.id,
            file_url=f"{base}/file?v={version}",
            preview_url=f"{base}/preview?width={PREVIEW_WIDTH_PX}&v={version}",
            width_px=image.width_px,
            height_px=image.height_px,
            captured_at=image.captured_at,
            file_name=image.file_name,
            sha256=image.sha256,
        )


class PoseVessel(BaseModel):
    """The vessel a pose is of."""

    mmsi: int
    name: str | None
    ship_type: int | None


class PoseDetection(BaseModel):
    """The box a pose was fitted to, px."""

    id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    score: float


class Position(BaseModel):
    """A WGS84 place; the height is above the ellipsoid."""

    lat_deg: float
    lon_deg: float
    height_m: float


class Segments(BaseModel):
    """The water-level plane segment, 4 corners (u, v) each, as it moved."""

    reported: Pixels
    dead_reckoned: Pixels
    corrected: Pixels


class PoseOut(BaseModel):
    """A generated 6D pose with what it was made of and the newest verdict on it."""

    id: int
    run_id: int
    image: PoseImage
    vessel: PoseVessel
    detection: PoseDetection
    cost: float
    cost_terms: dict[str, Any]
    centroid_in_cam_m: list[float]
    rotvec_cam_from_vessel: list[float]
    position: Position
    heading_deg: float
    heading_source: str
    length_m: float
    width_m: float
    height_m: float
    corners_in_image_px: Pixels
    segments_px: Segments
    correction_in_enu_m: list[float]
    report_age_s: float
    speed_kn: float
    flags: list[str]
    review: ReviewOut | None

    @classmethod
    def of(cls, reviewed: ReviewedPose) -> "PoseOut":
        """Put a pose, its match and its verdict together."""
        pose, vessel, review = reviewed.pose, reviewed.vessel, reviewed.review
        box, state = pose.match.detection, pose.match.vessel_state
        return cls(
            id=pose.id,
            run_id=pose.run_id,
            image=PoseImage.of(pose.image),
            vessel=PoseVessel(
                mmsi=pose.mmsi,
                name=vessel.name if vessel else None,
                ship_type=vessel.ship_type if vessel else None,
            ),
            detection=PoseDetection(
                id=box.id,
                x1_px=box.x1_px,
                y1_px=box.y1_px,
                x2_px=box.x2_px,
                y2_px=box.y2_px,
                score=box.score,
            ),
            cost=pose.match.cost,
            cost_terms=pose.match.cost_terms,
            centroid_in_cam_m=pose.centroid_in_cam_m,
            rotvec_cam_from_vessel=pose.rotvec_cam_from_vessel,
            position=Position(
                lat_deg=pose.lat_deg, lon_deg=pose.lon_deg, height_m=pose.center_height_m
            ),
            heading_deg=pose.heading_deg,
            heading_source=state.heading_source,
            length_m=pose.length_m,
            width_m=pose.width_m,
            height_m=pose.height_m,
            corners_in_image_px=list(pose.corners_in_image_px),
            segments_px=Segments(
                reported=state.segments_px["reported"],
                dead_reckoned=state.segments_px["dead_reckoned"],
                corrected=list(pose.corrected_segment_px),
            ),
            correction_in_enu_m=pose.correction_in_enu_m,
            report_age_s=state.age_s,
            speed_kn=state.speed_kn,
            flags=pose.flags,
            review=ReviewOut.of(review) if review else None,
        )
