"""Shapes of corrections, of re-matching, and of the camera a browser draws with."""

from dataclasses import asdict
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.upright_box import UprightBox
from app.identities.shown import Identities, VesselId
from app.ids import RowId, VesselRef
from app.reviews.corrections import Spot
from app.reviews.image_schemas import DetectionOut
from app.reviews.pose_schemas import CorrectionOut, LocalBox, Pixels
from app.reviews.rematching import REASONS, Offered, Refused, segment_pixels
from app.reviews.schemas import CommentText

Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Metres = Annotated[float, Field(ge=-20_000, le=20_000, allow_inf_nan=False)]
_PAIRS = (("lat_deg", "lon_deg"), ("east_m", "north_m"), ("across_m", "away_m"))


class CorrectionIn(BaseModel):
    """A box as a person would have it: a place, given in one of three ways, heading and sizes."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "across_m": 1.5,
                    "away_m": -3,
                    "heading_deg": 92.5,
                    "length_m": 81,
                    "width_m": 12,
                    "height_m": 9.5,
                }
            ]
        },
    )

    lat_deg: Latitude | None = None
    lon_deg: Longitude | None = None
    east_m: Metres | None = None
    north_m: Metres | None = None
    across_m: Annotated[Metres | None, Field(description="To the right, from the reference")] = None
    away_m: Annotated[Metres | None, Field(description="From the camera")] = None
    up_m: Annotated[
        Metres | None, Field(description="Above the reference; left out: as it stands")
    ] = None
    heading_deg: Annotated[float, Field(ge=-360, le=720, allow_inf_nan=False)]
    length_m: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
    width_m: Annotated[float, Field(gt=0, le=200, allow_inf_nan=False)]
    height_m: Annotated[float, Field(gt=0, le=200, allow_inf_nan=False)]
    comment: CommentText | None = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        given = [pair for pair in _PAIRS if any(getattr(self, name) is not None for name in pair)]
        halves = [pair for pair in given if any(getattr(self, name) is None for name in pair)]
        if len(given) != 1 or halves:
            raise ValueError(
                "give one place: lat_deg and lon_deg, or east_m and north_m, or across_m and away_m"
            )
        return self

    def spot(self) -> Spot:
        """Return the place."""

        def pair(first: float | None, second: float | None) -> tuple[float, float] | None:
            return None if first is None or second is None else (first, second)

        return Spot(
            lat_lon_deg=pair(self.lat_deg, self.lon_deg),
            east_north_m=pair(self.east_m, self.north_m),
            across_away_m=pair(self.across_m, self.away_m),
        )


class RematchIn(BaseModel):
    """The vessel that a detection really shows."""

    model_config = ConfigDict(extra="forbid")

    mmsi: VesselRef


class PersonPoseIn(RematchIn):
    """The vessel that a detection of a run shows."""

    run_id: RowId


class GeodeticOut(BaseModel):
    """A WGS84 place with its ellipsoidal height."""

    lat_deg: float
    lon_deg: float
    height_m: float

    @classmethod
    def of(cls, place: Geodetic) -> "GeodeticOut":
        """Take a place."""
        return cls(lat_deg=place.lat_deg, lon_deg=place.lon_deg, height_m=place.height_m)


class IntrinsicsOut(BaseModel):
    """What belongs to a camera's body and lens; distortion is k1, k2, p1, p2, k3 (OpenCV)."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: list[float]


def _intrinsics(camera: Camera) -> dict[str, Any]:
    inner = camera.intrinsics
    focal, principal = inner.focal_px.tolist(), inner.principal_point_px.tolist()
    return {
        "width_px": inner.width_px,
        "height_px": inner.height_px,
        "fx_px": focal[0],
        "fy_px": focal[1],
        "cx_px": principal[0],
        "cy_px": principal[1],
        "distortion": inner.distortion.tolist(),
    }


class LocalCameraOut(IntrinsicsOut):
    """A camera in the east-north-up frame at a pose's reference."""

    R_cam_from_local: list[list[float]]
    center_in_local_m: list[float]

    @classmethod
    def of(cls, camera: Camera) -> "LocalCameraOut":
        """Take a camera."""
        return cls(
            **_intrinsics(camera),
            R_cam_from_local=camera.R_cam_from_world.tolist(),
            center_in_local_m=camera.center_in_world.tolist(),
        )


class RunCameraOut(IntrinsicsOut):
    """The camera of a run in its site's east-north-up frame."""

    R_cam_from_enu: list[list[float]]
    center_in_enu_m: list[float]
    lat_deg: float
    lon_deg: float
    height_m: float
    origin: GeodeticOut
    water_level_m: float

    @classmethod
    def of(cls, camera: Camera, frame: EnuFrame, water_level_m: float) -> "RunCameraOut":
        """Take a camera and its frame."""
        place = frame.geodetic(camera.center_in_world)
        return cls(
            **_intrinsics(camera),
            R_cam_from_enu=camera.R_cam_from_world.tolist(),
            center_in_enu_m=camera.center_in_world.tolist(),
            lat_deg=place.lat_deg,
            lon_deg=place.lon_deg,
            height_m=place.height_m,
            origin=GeodeticOut.of(frame.origin),
            water_level_m=water_level_m,
        )


def local_box_out(box: UprightBox) -> LocalBox:
    """Return a box as JSON has it."""
    return LocalBox(**asdict(box))


class EditOut(BaseModel):
    """All that is needed to draw and edit a pose's box: camera, generated box, present box."""

    pose_id: int
    version: int
    reference: GeodeticOut
    camera: LocalCameraOut
    generated: LocalBox
    current: LocalBox
    correction: CorrectionOut | None
    corrections: list[CorrectionOut]


class DeletedOut(BaseModel):
    """A pose whose correction was taken away, and the version that this is."""

    pose_id: int
    version: int


class CandidateOut(BaseModel):
    """A vessel that a detection may show, with the matching cost against it."""

    mmsi: VesselId
    name: str | None
    ship_type: int | None
    vessel_state_id: int
    cost: float | None
    cost_terms: dict[str, float]
    length_m: float
    width_m: float
    age_s: float
    heading_deg: float
    outcome: str
    pose_id: Annotated[int | None, Field(description="Another pose of this vessel here")]
    current: Annotated[bool, Field(description="The vessel that the pose is of now")]
    segment_px: Pixels
    rectangle_px: list[float]

    @classmethod
    def of(
        cls,
        offered: Offered,
        told: Identities,
        *,
        pose_id: int | None,
        current_mmsi: int | None,
    ) -> "CandidateOut":
        """Put a vessel and its cost together; `pose_id` is the pose in question."""
        state, cost = offered.state, offered.cost.total
        return cls(
            mmsi=told.vessel(state.mmsi),
            name=told.name(offered.vessel.name) if offered.vessel else None,
            ship_type=offered.vessel.ship_type if offered.vessel else None,
            vessel_state_id=state.id,
            cost=cost if cost < float("inf") else None,
            cost_terms=offered.cost.terms(),
            length_m=state.to_bow_m + state.to_stern_m,
            width_m=state.to_port_m + state.to_starboard_m,
            age_s=state.age_s,
            heading_deg=state.heading_deg,
            outcome=state.outcome,
            pose_id=None if offered.pose_id == pose_id else offered.pose_id,
            current=state.mmsi == current_mmsi,
            segment_px=list(segment_pixels(offered)),
            rectangle_px=offered.rectangle_px.tolist(),
        )


class RefusedOut(BaseModel):
    """A vessel that cannot be what a detection shows, and why."""

    mmsi: VesselId
    name: str | None
    reason: str
    text: str

    @classmethod
    def of(cls, refused: Refused, told: Identities) -> "RefusedOut":
        """Say why."""
        return cls(
            mmsi=told.vessel(refused.state.mmsi),
            name=told.name(refused.vessel.name) if refused.vessel else None,
            reason=refused.reason.value,
            text=REASONS[refused.reason],
        )


class CandidatesOut(BaseModel):
    """Who a detection may show, cheapest first, and who it cannot."""

    detection: DetectionOut
    candidates: list[CandidateOut]
    refused: list[RefusedOut]
