"""Requests and answers of landmarks: named world points, shared by all viewports of a site."""

from typing import Self

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

from app.sites.fields import HeightDatum, HeightM, LatDeg, LonDeg, Name, Request
from app.tables.registration import Landmark

LANDMARK_EXAMPLE: JsonDict = {
    "name": "Crane, top",
    "lat_deg": "53°32'27.6\"N",
    "lon_deg": "9°58'48.4\"E",
    "height_m": 52.3,
    "height_datum": "water",
}
DATUM_NOTE = "`water`: height_m is above the site's water level; it is stored above the ellipsoid"


class LandmarkIn(Request):
    """A new landmark of a site."""

    model_config = ConfigDict(json_schema_extra={"examples": [LANDMARK_EXAMPLE]})

    name: Name
    lat_deg: LatDeg
    lon_deg: LonDeg
    height_m: HeightM
    height_datum: HeightDatum = Field(HeightDatum.ELLIPSOID, description=DATUM_NOTE)

    def place(self, water_level_m: float) -> tuple[float, float, float]:
        """Return the place with its ellipsoidal height."""
        height_m = self.height_datum.ellipsoidal(self.height_m, water_level_m)
        return self.lat_deg, self.lon_deg, height_m


class LandmarkPatch(Request):
    """What to change of a landmark; all viewports that see it follow."""

    name: Name | None = None
    lat_deg: LatDeg | None = None
    lon_deg: LonDeg | None = None
    height_m: HeightM | None = None
    height_datum: HeightDatum = Field(HeightDatum.ELLIPSOID, description=DATUM_NOTE)


class LandmarkOut(BaseModel):
    """A landmark; `height_m` is above the WGS84 ellipsoid."""

    id: int
    site_id: int
    name: str
    lat_deg: float
    lon_deg: float
    height_m: float
    height_above_water_m: float
    viewport_count: int
    version: int

    @classmethod
    def of(cls, landmark: Landmark, water_level_m: float, viewport_count: int) -> Self:
        """Show a row."""
        return cls(
            id=landmark.id,
            site_id=landmark.site_id,
            name=landmark.name,
            lat_deg=landmark.lat_deg,
            lon_deg=landmark.lon_deg,
            height_m=landmark.height_m,
            height_above_water_m=landmark.height_m - water_level_m,
            viewport_count=viewport_count,
            version=landmark.version,
        )


class ImportedOut(BaseModel):
    """What became of a table of landmarks."""

    created: int
    moved: int
    unchanged: int


class PlaceOut(BaseModel):
    """A place that was typed, understood."""

    lat_deg: float
    lon_deg: float
    height_m: float = Field(description="Above the WGS84 ellipsoid")
    enu_m: list[float] = Field(description="In the site's frame")
    distance_m: float = Field(description="From the site's origin")
