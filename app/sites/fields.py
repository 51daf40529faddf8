"""Kinds of fields shared by the requests of sites, cameras and viewports.

Every bound here is one a database, a formula or a page would otherwise stumble over later: text
without control characters, numbers that are finite, zones that exist.
"""

from datetime import UTC, datetime
from enum import StrEnum
from functools import partial
from typing import Annotated, Any
from zoneinfo import ZoneInfo

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic import StringConstraints as Text

from app.domain.coordinates import Axis, parse_angle
from app.errors import Invalid
from app.sites.name_pattern import check_pattern

HIGHEST_M = 10_000
DISTORTION_LENGTHS = (0, 4, 5)
EARLIEST = datetime(1970, 1, 1, tzinfo=UTC)
LATEST = datetime(2200, 1, 1, tzinfo=UTC)


class Request(BaseModel):
    """Parent of request bodies: an unknown field is an error, because a typo must not be silent."""

    model_config = ConfigDict(extra="forbid")


def _known_zone(name: str) -> str:
    try:
        ZoneInfo(name)
    except (ValueError, OSError, KeyError) as error:
        raise ValueError(
            f"{name!r} is no time zone; use a name such as UTC or Europe/Berlin"
        ) from error
    return name


def _five_terms(terms: list[float]) -> list[float]:
    if len(terms) not in DISTORTION_LENGTHS:
        raise ValueError(
            "distortion takes 0, 4 or 5 numbers in OpenCV's order: k1, k2, p1, p2 and k3"
        )
    return terms + [0.0] * (5 - len(terms))


def _list_or_place(value: object) -> object:
    if isinstance(value, list | tuple) and len(value) == 3:
        return dict(zip(("lat_deg", "lon_deg", "height_m"), value, strict=True))
    return value


def _angle(axis: Axis, value: object) -> object:
    return parse_angle(value, axis) if isinstance(value, str) else value


def in_zone(moment: datetime, timezone: str, field: str) -> datetime:
    """Return a moment in UTC; one without a zone is taken in `timezone` (DST's first pass).

    Raises Invalid naming the field when it lies outside 1970 to 2199.
    """
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=ZoneInfo(timezone))
    try:
        moment = moment.astimezone(UTC)
    except OverflowError:
        moment = datetime.min.replace(tzinfo=UTC)
    if not EARLIEST <= moment < LATEST:
        raise Invalid.field(field, "must lie between 1970 and 2199")
    return moment


Name = Annotated[
    str,
    Text(strip_whitespace=True, min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]+$"),
]
Timezone = Annotated[
    str, Text(max_length=64), AfterValidator(_known_zone), Field(examples=["Europe/Berlin"])
]
Pattern = Annotated[Name, AfterValidator(check_pattern)]
HeightM = Annotated[
    float,
    Field(ge=-HIGHEST_M, le=HIGHEST_M, description="Metres above the WGS84 ellipsoid"),
]
LatDeg = Annotated[
    float,
    BeforeValidator(partial(_angle, Axis.LATITUDE)),
    Field(ge=-90, le=90, description="A number, or text: 53.5426, 53 32 33.4 N"),
]
LonDeg = Annotated[
    float,
    BeforeValidator(partial(_angle, Axis.LONGITUDE)),
    Field(ge=-180, le=180, description="A number, or text: 9.9808, 9 58 51 E"),
]
PixelCount = Annotated[int, Field(ge=1, le=65_535)]
FocalPx = Annotated[float, Field(gt=0, le=1e7)]
CoordinatePx = Annotated[float, Field(ge=-1e6, le=1e6)]
Distortion = Annotated[
    list[Annotated[float, Field(ge=-1e6, le=1e6)]],
    AfterValidator(_five_terms),
    Field(description="k1, k2, p1, p2, k3 in OpenCV's order; 0, 4 or 5 numbers"),
]
Matrix = Annotated[
    list[
        Annotated[list[Annotated[float, Field(ge=-1e7, le=1e7)]], Field(min_length=3, max_length=3)]
    ],
    Field(min_length=3, max_length=3),
]


class Place(Request):
    """A WGS84 place with ellipsoidal height; a list [lat, lon, height] is taken as well."""

    lat_deg: LatDeg = Field(examples=[53.5422])
    lon_deg: LonDeg = Field(examples=[9.9835])
    height_m: HeightM = 0.0


PlaceIn = Annotated[Place, BeforeValidator(_list_or_place)]


class HeightDatum(StrEnum):
    """What a height is measured from."""

    ELLIPSOID = "ellipsoid"  # WGS84, as GNSS receivers give it
    WATER = "water"  # the site's water level

    def ellipsoidal(self, height_m: float, water_level_m: float) -> float:
        """Return a height above the ellipsoid."""
        return height_m + (water_level_m if self is HeightDatum.WATER else 0.0)


class IntrinsicsFields(Request):
    """Focal lengths and principal point in px, one by one or as the matrix K."""

    K: Matrix | None = Field(None, description="[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    fx_px: FocalPx | None = None
    fy_px: FocalPx | None = None
    cx_px: CoordinatePx | None = None
    cy_px: CoordinatePx | None = None

    def pinhole(self) -> dict[str, float]:
        """Return what was given of fx_px, fy_px, cx_px, cy_px.

        Raises ValueError for a K with skew or one that contradicts the single numbers.
        """
        names = ("fx_px", "fy_px", "cx_px", "cy_px")
        single = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        if self.K is None:
            return single
        (fx, skew, cx), (zero, fy, cy), last = self.K
        if skew or zero or last != [0, 0, 1] or fx <= 0 or fy <= 0:
            raise ValueError(
                "K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy, no skew"
            )
        from_matrix = dict(zip(names, (fx, fy, cx, cy), strict=True))
        if any(from_matrix[name] != value for name, value in single.items()):
            raise ValueError("K and fx_px, fy_px, cx_px, cy_px disagree; give one or the other")
        return from_matrix


def matrix_of(pinhole: dict[str, Any]) -> list[list[float]]:
    """Return K (3, 3) of fx_px, fy_px, cx_px, cy_px."""
    return [
        [pinhole["fx_px"], 0.0, pinhole["cx_px"]],
        [0.0, pinhole["fy_px"], pinhole["cy_px"]],
        [0.0, 0.0, 1.0],
    ]
