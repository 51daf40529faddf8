"""Requests and answers of sites and cameras."""

from datetime import datetime
from typing import Any, Self

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from app.sites.fields import (
    Distortion,
    HeightM,
    IntrinsicsFields,
    Name,
    Pattern,
    PixelCount,
    Place,
    PlaceIn,
    Request,
    Timezone,
    matrix_of,
)
from app.tables.sites import Camera, Site

SITE_EXAMPLE: JsonDict = {
    "name": "Elbe at the bridge",
    "origin": {"lat_deg": 53.5422, "lon_deg": 9.9835, "height_m": 40.0},
    "water_level_m": 39.6,
    "timezone": "Europe/Berlin",
}
CAMERA_EXAMPLE: JsonDict = {
    "site_id": 1,
    "name": "East",
    "width_px": 2560,
    "height_px": 1920,
    "K": [[6570.7, 0, 1187.0], [0, 6592.3, 935.2], [0, 0, 1]],
    "distortion": [],
    "timezone": "Europe/Berlin",
    "file_name_pattern": "cam_%Y%m%d_%H%M%S",
}
PSEUDONYMS_NOTE = (
    "Whether vessels are shown as pseudonyms to all but operators and administrators of the site"
)
PATTERN_NOTE = (
    "How file names tell the time, with strptime's letters, without the extension: "
    "cam_%Y%m%d_%H%M%S"
)


class SiteIn(Request):
    """A new site. The origin carries the site's east-north-up frame."""

    model_config = ConfigDict(json_schema_extra={"examples": [SITE_EXAMPLE]})

    name: Name
    origin: PlaceIn
    water_level_m: HeightM = 0.0
    timezone: Timezone = "UTC"
    is_simulated: bool = False
    shows_pseudonyms: bool = Field(False, description=PSEUDONYMS_NOTE)


class SitePatch(Request):
    """What to change of a site; fields left out stay."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"water_level_m": 40.1}]})

    name: Name | None = None
    origin: PlaceIn | None = None
    water_level_m: HeightM | None = None
    timezone: Timezone | None = None
    shows_pseudonyms: bool | None = Field(None, description=PSEUDONYMS_NOTE)


class SiteOut(BaseModel):
    """A site."""

    id: int
    name: str
    origin: Place
    water_level_m: float
    timezone: str
    is_simulated: bool
    shows_pseudonyms: bool = Field(description=PSEUDONYMS_NOTE)
    created_at: datetime
    version: int

    @classmethod
    def of(cls, site: Site) -> Self:
        """Show a row."""
        return cls(
            id=site.id,
            name=site.name,
            origin=Place(
                lat_deg=site.origin_lat_deg,
                lon_deg=site.origin_lon_deg,
                height_m=site.origin_height_m,
            ),
            water_level_m=site.water_level_m,
            timezone=site.timezone,
            is_simulated=site.is_simulated,
            shows_pseudonyms=site.shows_pseudonyms,
            created_at=site.created_at,
            version=site.version,
        )


class CameraIn(IntrinsicsFields):
    """A new camera: its image size and intrinsics (K, or fx_px, fy_px, cx_px, cy_px)."""

    model_config = ConfigDict(json_schema_extra={"examples": [CAMERA_EXAMPLE]})

    site_id: int
    name: Name
    width_px: PixelCount = Field(validation_alias=AliasChoices("width_px", "width"))
    height_px: PixelCount = Field(validation_alias=AliasChoices("height_px", "height"))
    distortion: Distortion = [0.0] * 5
    timezone: Timezone | None = Field(None, description="The site's when left out")
    file_name_pattern: Pattern | None = Field(None, description=PATTERN_NOTE)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        missing = {"fx_px", "fy_px", "cx_px", "cy_px"} - self.pinhole().keys()
        if missing:
            raise ValueError(
                f"give the intrinsics as K (3 x 3) or as fx_px, fy_px, cx_px and cy_px; "
                f"missing: {', '.join(sorted(missing))}"
            )
        return self


class CameraPatch(IntrinsicsFields):
    """What to change of a camera; registrations keep the intrinsics they were solved with."""

    name: Name | None = None
    width_px: PixelCount | None = None
    height_px: PixelCount | None = None
    distortion: Distortion | None = None
    timezone: Timezone | None = None
    file_name_pattern: Pattern | None = Field(None, description=PATTERN_NOTE)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self.pinhole()
        return self


class CameraOut(BaseModel):
    """A camera."""

    id: int
    site_id: int
    name: str
    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    K: list[list[float]]
    distortion: list[float]
    timezone: str
    file_name_pattern: str | None
    created_at: datetime
    version: int

    @classmethod
    def of(cls, camera: Camera) -> Self:
        """Show a row."""
        names = [name for name in cls.model_fields if name != "K"]
        values: dict[str, Any] = {name: getattr(camera, name) for name in names}
        return cls(K=matrix_of(values), **values)
