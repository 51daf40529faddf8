"""Shapes of poses in REST: what was generated, of what it was made, and what people made of it."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from app.identities.shown import Identities, VesselId
from app.reviews.schemas import ReviewOut
from app.reviews.service import ReviewedPose
from app.tables.ais import Vessel
from app.tables.imagery import Image
from app.tables.reviews import Correction, CorrectionKind

Pixels = list[list[float] | None]
PREVIEW_WIDTH_PX = 1280


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

    mmsi: VesselId
    name: str | None
    ship_type: int | None

    @classmethod
    def of(cls, mmsi: int, vessel: Vessel | None, told: Identities) -> "PoseVessel":
        """Tell what the caller may know of a vessel."""
        return cls(
            mmsi=told.vessel(mmsi),
            name=told.name(vessel.name) if vessel else None,
            ship_type=vessel.ship_type if vessel else None,
        )


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


class LocalBox(BaseModel):
    """An upright box: the centre of its bottom from a place, east, north and up; its heading."""

    east_m: float
    north_m: float
    up_m: float
    heading_deg: float
    length_m: float
    width_m: float
    height_m: float


class CorrectionOut(BaseModel):
    """A pose as a person would have it; `box` is left out in lists."""

    id: int
    pose_id: int
    version: int
    kind: CorrectionKind
    user: str | None
    user_id: int | None
    created_at: datetime
    deleted_at: datetime | None
    comment: str | None
    mmsi: VesselId
    vessel: PoseVessel | None
    box: LocalBox | None
    lat_deg: float
    lon_deg: float
    base_height_m: float
    center_height_m: float
    heading_deg: float
    length_m: float
    width_m: float
    height_m: float
    centroid_in_cam_m: list[float]
    rotvec_cam_from_vessel: list[float]
    corners_in_image_px: Pixels
    cost: float | None
    cost_terms: dict[str, Any] | None
    flags: list[str]

    @classmethod
    def of(
        cls,
        correction: Correction,
        told: Identities,
        *,
        vessel: PoseVessel | None = None,
        box: LocalBox | None = None,
    ) -> "CorrectionOut":
        """Take the columns of a correction."""
        user = correction.user
        return cls(
            id=correction.id,
            pose_id=correction.pose_id,
            version=correction.version,
            kind=correction.kind,
            user=user.name or user.email if user else None,
            user_id=correction.user_id,
            created_at=correction.created_at,
            deleted_at=correction.deleted_at,
            comment=correction.comment,
            mmsi=told.vessel(correction.mmsi),
            vessel=vessel,
            box=box,
            lat_deg=correction.lat_deg,
            lon_deg=correction.lon_deg,
            base_height_m=correction.base_height_m,
            center_height_m=correction.center_height_m,
            heading_deg=correction.heading_deg,
            length_m=correction.length_m,
            width_m=correction.width_m,
            height_m=correction.height_m,
            centroid_in_cam_m=correction.centroid_in_cam_m,
            rotvec_cam_from_vessel=correction.rotvec_cam_from_vessel,
            corners_in_image_px=list(correction.corners_in_image_px),
            cost=correction.cost,
            cost_terms=correction.cost_terms,
            flags=correction.flags,
        )


class PoseOut(BaseModel):
    """A generated 6D pose with what it was made of and what people say of it.

    `review` is the verdict that counts, `mine` the caller's own; the generated values stay as they
    are beside a `correction`, whose version is the ETag of the pose.
    """

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
    track_method: str | None = Field(
        description="How the position was carried to the image's time; null: an old run"
    )
    report_ids: list[int] = Field(description="The AIS positions it was made from")
    static_ids: list[int] = Field(description="The AIS static reports that told its size")
    length_m: float
    width_m: float
    height_m: float
    corners_in_image_px: Pixels
    segments_px: Segments
    correction_in_enu_m: list[float]
    position_covariance_in_enu_m2: list[list[float]] | None = Field(
        description=(
            "Of `position`, east, north, up (3 x 3), relative to the registered camera; it and the "
            "sigmas are null where the preset does not estimate them (`paper`)"
        )
    )
    heading_sigma_deg: float | None = Field(description="One standard deviation")
    height_sigma_m: float | None = Field(description="One standard deviation")
    report_age_s: float
    speed_kn: float
    flags: list[str]
    person_made: bool
    review: ReviewOut | None
    mine: ReviewOut | None
    opinions: int
    disagreement: bool
    bookmarked: bool
    comments: int
    correction: CorrectionOut | None
    correction_version: int

    @classmethod
    def of(cls, reviewed: ReviewedPose) -> "PoseOut":
        """Put a pose, its match and its verdict together."""
        pose, vessel, review = reviewed.pose, reviewed.vessel, reviewed.review
        mine, correction, beside = reviewed.mine, reviewed.correction, reviewed.beside
        box, state, told = pose.match.detection, pose.match.vessel_state, reviewed.told
        return cls(
            id=pose.id,
            run_id=pose.run_id,
            image=PoseImage.of(pose.image),
            vessel=PoseVessel.of(pose.mmsi, vessel, told),
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
            track_method=state.track_method,
            report_ids=state.report_ids,
            static_ids=state.static_ids,
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
            position_covariance_in_enu_m2=pose.position_covariance_in_enu_m2,
            heading_sigma_deg=pose.heading_sigma_deg,
            height_sigma_m=pose.height_sigma_m,
            report_age_s=state.age_s,
            speed_kn=state.speed_kn,
            flags=pose.flags,
            person_made=pose.person_made,
            review=ReviewOut.of(review) if review else None,
            mine=ReviewOut.of(mine) if mine else None,
            opinions=len(reviewed.reviews),
            disagreement=reviewed.disagreement,
            bookmarked=beside.bookmarked,
            comments=beside.comments,
            correction=correction
            and CorrectionOut.of(
                correction,
                told,
                vessel=PoseVessel.of(correction.mmsi, reviewed.corrected_vessel, told),
            ),
            correction_version=beside.correction_version,
        )
