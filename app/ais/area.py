"""A box of latitude and longitude, the one shape of area that a plain index can serve.

A camera sees a few kilometres; a query for its surroundings needs no exact circle, only a box that
holds it. A box whose west edge lies east of its east edge crosses the antimeridian (RFC 7946, 5.2).
"""

import math
from dataclasses import dataclass
from typing import Self

from app.domain.cells import cells_of_box
from app.errors import Invalid

_MOST_CELLS = 400  # some 100 by 100 km; beyond it other conditions choose better
# The shortest length of a degree of latitude on WGS84, at the equator: the box errs to the outside.
_METRES_PER_DEG = 110_574.0


@dataclass(frozen=True, slots=True)
class Area:
    """WGS84 degrees; `west_deg` > `east_deg` for a box across the antimeridian."""

    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float

    @classmethod
    def around(cls, lat_deg: float, lon_deg: float, radius_m: float) -> Self:
        """Return the smallest box that holds all within `radius_m` of a place."""
        half_lat_deg = radius_m / _METRES_PER_DEG
        south_deg = max(-90.0, lat_deg - half_lat_deg)
        north_deg = min(90.0, lat_deg + half_lat_deg)
        widest = math.cos(math.radians(max(abs(south_deg), abs(north_deg))))
        half_lon_deg = half_lat_deg / widest if widest > 1e-6 else 180.0
        if half_lon_deg >= 180.0:
            return cls(-180.0, south_deg, 180.0, north_deg)
        return cls(
            _wrapped(lon_deg - half_lon_deg), south_deg, _wrapped(lon_deg + half_lon_deg), north_deg
        )

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read `min_lon,min_lat,max_lon,max_lat`. Raises Invalid naming the field `bbox`."""
        try:
            west_deg, south_deg, east_deg, north_deg = (float(part) for part in text.split(","))
        except ValueError as error:
            raise Invalid.field(
                "bbox", "give four numbers: min_lon,min_lat,max_lon,max_lat"
            ) from error
        if not (-90 <= south_deg <= north_deg <= 90):
            raise Invalid.field("bbox", "latitudes must lie in -90..90, the smaller one first")
        if not (-180 <= west_deg <= 180 and -180 <= east_deg <= 180):
            raise Invalid.field("bbox", "longitudes must lie in -180..180")
        return cls(west_deg, south_deg, east_deg, north_deg)

    @property
    def crosses_antimeridian(self) -> bool:
        """Whether the box reaches over 180 degrees."""
        return self.west_deg > self.east_deg

    @property
    def cells(self) -> list[int] | None:
        """The cells that the box touches; None for one too large to be found by them."""
        return cells_of_box(
            self.west_deg, self.south_deg, self.east_deg, self.north_deg, _MOST_CELLS
        )


def _wrapped(lon_deg: float) -> float:
    return (lon_deg + 180.0) % 360.0 - 180.0
