"""Shapes of a run's images, of missed vessels and of what surrounds them."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.identities.shown import Identities, VesselId
from app.ids import RowId
from app.reviews.pose_schemas import Pixels, PoseImage
from app.reviews.run_images import ImageOfRun
from app.reviews.schemas import CommentText
from app.tables.ais import Vessel
from app.tables.detection import Detection
from app.tables.reviews import ImageCompletion, MissedReason, MissedVessel
from app.tables.runs import VesselStateRow

Pixel = Annotated[float, Field(ge=-0.5, le=1e6, allow_inf_nan=False)]


class OfRunIn(BaseModel):
    """The run that something is said about."""

    model_config = ConfigDict(extra="forbid")

    run_id: RowId


class CompletionOut(BaseModel):
    """Who said when that an image is complete."""

    image_id: int
    run_id: int
    user: str | None
    created_at: datetime

    @classmethod
    def of(cls, completion: ImageCompletion) -> "CompletionOut":
        """Take the columns."""
        user = completion.user
        return cls(
            image_id=completion.image_id,
            run_id=completion.run_id,
            user=user.name or user.email if user else None,
            created_at=completion.created_at,
        )


class RunImageOut(BaseModel):
    """An image of a run and how far its reviewing is; `done` is the run's own part."""

    position: int
    image: PoseImage
    poses: int
    graded: int
    missed: int
    complete: CompletionOut | None
    done: bool
    error: str | None

    @classmethod
    def of(cls, found: ImageOfRun) -> "RunImageOut":
        """Put an image and its counts together."""
        return cls(
            position=found.row.position,
            image=PoseImage.of(found.image),
            poses=found.poses,
            graded=found.graded,
            missed=found.missed,
            complete=CompletionOut.of(found.completion) if found.completion else None,
            done=found.row.done_at is not None,
            error=found.row.error,
        )


class MissedIn(BaseModel):
    """A visible vessel without a pose: where it is, px, and why it was missed."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "run_id": 1,
                    "x1_px": 10,
                    "y1_px": 20,
                    "x2_px": 30.5,
                    "y2_px": 40,
                    "reason": "no_ais",
                }
            ]
        },
    )

    run_id: RowId
    x1_px: Pixel
    y1_px: Pixel
    x2_px: Pixel
    y2_px: Pixel
    reason: MissedReason
    comment: CommentText | None = None


class MissedPatch(BaseModel):
    """What shall change of a missed vessel."""

    model_config = ConfigDict(extra="forbid")

    x1_px: Pixel | None = None
    y1_px: Pixel | None = None
    x2_px: Pixel | None = None
    y2_px: Pixel | None = None
    reason: MissedReason | None = None
    comment: CommentText | None = None

    def changes(self) -> dict[str, object]:
        """Return the fields that were sent; only a comment can be taken away."""
        given = self.model_dump(exclude_unset=True)
        return {
            name: value for name, value in given.items() if value is not None or name == "comment"
        }


class MissedOut(BaseModel):
    """A missed vessel."""

    id: int
    image_id: int
    run_id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    reason: MissedReason
    comment: str | None
    user: str | None
    created_at: datetime
    version: int

    @classmethod
    def of(cls, missed: MissedVessel, user: str | None = None) -> "MissedOut":
        """Take the columns."""
        return cls(
            id=missed.id,
            image_id=missed.image_id,
            run_id=missed.run_id,
            x1_px=missed.x1_px,
            y1_px=missed.y1_px,
            x2_px=missed.x2_px,
            y2_px=missed.y2_px,
            reason=missed.reason,
            comment=missed.comment,
            user=user or (missed.user.name or missed.user.email if missed.user else None),
            created_at=missed.created_at,
            version=missed.version,
        )


class StateSegments(BaseModel):
    """The water-level plane segment of a vessel, 4 corners (u, v) each."""

    reported: Pixels
    dead_reckoned: Pixels


class VesselAtImage(BaseModel):
    """What AIS said of a vessel at the time of an image, and what became of it."""

    id: int
    mmsi: VesselId
    name: str | None
    ship_type: int | None
    outcome: str
    lat_deg: float
    lon_deg: float
    heading_deg: float
    heading_source: str
    track_method: str | None = Field(
        description="How the position was carried to the image's time; null: an old run"
    )
    report_ids: list[int] = Field(description="The AIS positions it was made from")
    static_ids: list[int] = Field(description="The AIS static reports that told its size")
    speed_kn: float
    age_s: float
    length_m: float
    width_m: float
    segments: StateSegments
    flags: list[str] = Field(description="What to know before trusting it")
    pose_id: int | None

    @classmethod
    def of(
        cls, state: VesselStateRow, vessel: Vessel | None, pose_id: int | None, told: Identities
    ) -> "VesselAtImage":
        """Take the columns."""
        segments = state.segments_px
        return cls(
            id=state.id,
            mmsi=told.vessel(state.mmsi),
            name=told.name(vessel.name) if vessel else None,
            ship_type=vessel.ship_type if vessel else None,
            outcome=state.outcome,
            lat_deg=state.lat_deg,
            lon_deg=state.lon_deg,
            heading_deg=state.heading_deg,
            heading_source=state.heading_source,
            track_method=state.track_method,
            report_ids=state.report_ids,
            static_ids=state.static_ids,
            speed_kn=state.speed_kn,
            age_s=state.age_s,
            length_m=state.to_bow_m + state.to_stern_m,
            width_m=state.to_port_m + state.to_starboard_m,
            segments=StateSegments(
                reported=segments.get("reported", []),
                dead_reckoned=segments.get("dead_reckoned", []),
            ),
            flags=state.flags,
            pose_id=pose_id,
        )


class DetectionOut(BaseModel):
    """A box of a detector, px, and the pose made of it."""

    id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    score: float
    class_id: int
    pose_id: int | None

    @classmethod
    def of(cls, box: Detection, pose_id: int | None) -> "DetectionOut":
        """Take the columns."""
        return cls(
            id=box.id,
            x1_px=box.x1_px,
            y1_px=box.y1_px,
            x2_px=box.x2_px,
            y2_px=box.y2_px,
            score=box.score,
            class_id=box.class_id,
            pose_id=pose_id,
        )
