"""Requests and answers of viewports, keypoints and registrations."""

from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import (
    AliasChoices,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    model_validator,
)
from pydantic.config import JsonDict

from app.sites.fields import (
    Distortion,
    HeightDatum,
    HeightM,
    IntrinsicsFields,
    LatDeg,
    LonDeg,
    Matrix,
    Name,
    PixelCount,
    Place,
    PlaceIn,
    Request,
    matrix_of,
)
from app.tables.registration import Keypoint, KeypointRole, Registration, RegistrationMethod
from app.tables.sites import Viewport

KEYPOINT_EXAMPLE: JsonDict = {
    "name": "Crane, top",
    "lat_deg": 53.5410,
    "lon_deg": 9.9801,
    "height_m": 92.4,
    "u_px": 812.5,
    "v_px": 640.0,
    "role": "control",
}
GIVEN_EXAMPLE: JsonDict = {
    "method": "given",
    "rotation": [1.2, -1.9, 1.6],
    "center": {"lat_deg": 53.5422, "lon_deg": 9.9835, "height_m": 31.8},
}
MOMENT_NOTE = "ISO 8601; without a zone it is in the camera's. Open when left out"
MOST_KEYPOINTS = 500  # leaving each out in turn takes a second
CoordinatePx = Annotated[float, Field(ge=-1e6, le=1e6)]


class ViewportIn(Request):
    """A new viewport: one pointing of a camera and the times it holds for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"camera_id": 1, "name": "East"}]})

    camera_id: int
    name: Name
    valid_from: datetime | None = Field(None, description=MOMENT_NOTE)
    valid_until: datetime | None = Field(None, description=f"{MOMENT_NOTE}. Not included")


class ViewportPatch(Request):
    """What to change of a viewport; fields left out stay, null opens a range."""

    name: Name | None = None
    valid_from: datetime | None = Field(None, description=MOMENT_NOTE)
    valid_until: datetime | None = Field(None, description=f"{MOMENT_NOTE}. Not included")


class ViewportOut(BaseModel):
    """A viewport; `registration_id` is the newest solution with a camera pose."""

    id: int
    site_id: int
    camera_id: int
    name: str
    valid_from: datetime | None
    valid_until: datetime | None
    keypoint_count: int
    registration_id: int | None
    created_at: datetime
    version: int

    @classmethod
    def of(cls, viewport: Viewport, keypoint_count: int, registration_id: int | None) -> Self:
        """Show a row."""
        return cls(
            id=viewport.id,
            site_id=viewport.camera.site_id,
            camera_id=viewport.camera_id,
            name=viewport.name,
            valid_from=viewport.valid_from,
            valid_until=viewport.valid_until,
            keypoint_count=keypoint_count,
            registration_id=registration_id,
            created_at=viewport.created_at,
            version=viewport.version,
        )


class KeypointIn(Request):
    """A landmark seen at (u, v): a new one by name and place, or a known one by name or id."""

    model_config = ConfigDict(json_schema_extra={"examples": [KEYPOINT_EXAMPLE]})

    id: int | None = Field(None, description="Ignored, so that what was read can be sent back")
    landmark_id: int | None = None
    name: Name | None = None
    lat_deg: LatDeg | None = None
    lon_deg: LonDeg | None = None
    height_m: HeightM | None = None
    height_datum: HeightDatum = HeightDatum.ELLIPSOID
    u_px: CoordinatePx
    v_px: CoordinatePx
    role: KeypointRole = KeypointRole.CONTROL

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.name is None and self.landmark_id is None:
            raise ValueError("a keypoint needs the name or the landmark_id of what it shows")
        given = [value is not None for value in (self.lat_deg, self.lon_deg, self.height_m)]
        if any(given) and not all(given):
            raise ValueError("a landmark's place needs lat_deg, lon_deg and height_m together")
        return self

    def place(self, water_level_m: float) -> tuple[float, float, float] | None:
        """Return the place given for the landmark, if any, with its ellipsoidal height."""
        if self.lat_deg is None or self.lon_deg is None or self.height_m is None:
            return None
        height_m = self.height_datum.ellipsoidal(self.height_m, water_level_m)
        return self.lat_deg, self.lon_deg, height_m


class KeypointsIn(Request):
    """All keypoints of a viewport; those there before are replaced. A bare list is taken too."""

    keypoints: list[KeypointIn] = Field(
        max_length=MOST_KEYPOINTS, validation_alias=AliasChoices("keypoints", "items")
    )
    update_landmarks: bool = Field(
        default=False, description="Move known landmarks to the places given here"
    )
    next_cursor: None = Field(None, description="Ignored, so that a list can be sent back")


def _bare_list(value: object) -> object:
    return {"keypoints": value} if isinstance(value, list) else value


KeypointsBody = Annotated[KeypointsIn, BeforeValidator(_bare_list)]


class KeypointOut(BaseModel):
    """A keypoint with its landmark."""

    id: int
    landmark_id: int
    name: str
    lat_deg: float
    lon_deg: float
    height_m: float
    u_px: float
    v_px: float
    role: KeypointRole

    @classmethod
    def of(cls, keypoint: Keypoint) -> Self:
        """Show a row."""
        return cls(
            id=keypoint.id,
            landmark_id=keypoint.landmark_id,
            name=keypoint.landmark.name,
            lat_deg=keypoint.landmark.lat_deg,
            lon_deg=keypoint.landmark.lon_deg,
            height_m=keypoint.landmark.height_m,
            u_px=keypoint.u_px,
            v_px=keypoint.v_px,
            role=keypoint.role,
        )


class GivenIntrinsics(IntrinsicsFields):
    """Intrinsics that hold for a given registration; the camera's for what is left out."""

    width_px: PixelCount | None = Field(None, validation_alias=AliasChoices("width_px", "width"))
    height_px: PixelCount | None = Field(None, validation_alias=AliasChoices("height_px", "height"))
    distortion: Distortion | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self.pinhole()
        return self


RotationVector = Annotated[
    list[Annotated[float, Field(ge=-100, le=100)]], Field(min_length=3, max_length=3)
]


class RegistrationIn(Request):
    """How to register a viewport: solve its keypoints, or take a pose that is known."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"method": "pnp"}, GIVEN_EXAMPLE]})

    method: RegistrationMethod
    rotation: RotationVector | Matrix | None = Field(
        None,
        description="given: Rodrigues vector (or 3 x 3 matrix) of cam_from_enu in the site's ENU",
    )
    center: PlaceIn | None = Field(
        None, description="given: the camera's place, or [lat, lon, ellipsoidal height]"
    )
    intrinsics: GivenIntrinsics | None = Field(None, description="given: else the camera's own")

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.method is RegistrationMethod.ROTATION:
            raise ValueError(
                "method `rotation` comes of an accepted pointing: POST "
                "/viewports/{id}/reregistrations, then /pointings/{id}/accept"
            )
        pose = (self.rotation, self.center)
        if self.method is RegistrationMethod.GIVEN:
            if None in pose:
                raise ValueError("method `given` needs rotation and center")
        elif (*pose, self.intrinsics) != (None, None, None):
            raise ValueError("rotation, center and intrinsics belong to method `given` only")
        return self


class ResidualOut(BaseModel):
    """How far a landmark's projection lies from its keypoint: projected minus observed, px.

    `is_used` is false for outliers and for keypoints that are no control points.
    """

    keypoint_id: int
    landmark_id: int
    name: str
    role: KeypointRole
    u_px: float
    v_px: float
    du_px: float | None
    dv_px: float | None
    error_px: float | None
    leave_one_out_px: float | None
    is_used: bool


class IntrinsicsOut(BaseModel):
    """The intrinsics in force; refined ones when there were enough keypoints."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    K: list[list[float]]
    distortion: list[float]


class RegistrationOut(BaseModel):
    """A solution and how good it is; lead with leave_one_out_px, the fit alone flatters."""

    id: int
    viewport_id: int
    method: RegistrationMethod
    rotation: list[float] | None
    center: Place | None
    intrinsics: IntrinsicsOut
    homography: list[list[float]] | None = Field(
        description="3 x 4, from homogeneous metres of the site's ENU to px"
    )
    covariance: list[list[float]] | None = Field(
        description="6 x 6: turns about the camera's x, y, z (rad), then east, north, up (m)"
    )
    mae_px: float | None
    mae_pct_width: float | None
    mae_pct_height: float | None
    leave_one_out_px: float | None
    check_mae_px: float | None = Field(description="Mean error of the keypoints of role `check`")
    residuals: list[ResidualOut]
    warnings: list[str]
    provenance: dict[str, Any] | None = Field(
        description="rotation: the registration, images and support that the turn rests on"
    )
    created_at: datetime

    @classmethod
    def of(cls, registration: Registration) -> Self:
        """Show a row."""
        center = None
        if registration.center_lat_deg is not None:
            center = Place(
                lat_deg=registration.center_lat_deg,
                lon_deg=registration.center_lon_deg or 0.0,
                height_m=registration.center_height_m or 0.0,
            )
        residuals = [ResidualOut.model_validate(item) for item in registration.residuals]
        checks = [
            item.error_px
            for item in residuals
            if item.role is KeypointRole.CHECK and item.error_px is not None
        ]
        intrinsics = registration.intrinsics
        made = {"center", "residuals", "intrinsics", "check_mae_px"}
        return cls(
            center=center,
            residuals=residuals,
            check_mae_px=sum(checks) / len(checks) if checks else None,
            intrinsics=IntrinsicsOut(K=matrix_of(intrinsics), **intrinsics),
            **{name: getattr(registration, name) for name in cls.model_fields.keys() - made},
        )
