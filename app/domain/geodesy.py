"""From latitude and longitude to metres, in a world frame that the camera can share.

AIS speaks in WGS84 degrees, cameras in metres. Two metric frames serve: geocentric ECEF
(EPSG:4978, which published data uses) and a local tangent frame east-north-up (ENU), in which
numbers stay small enough for camera registration. Both are rigid copies of each other, so a pose
in the camera frame does not depend on the choice. "Up" differs from place to place (10 arc seconds
over 300 m): it is always the ellipsoid's normal at the place asked for, never at the origin.
"""

from dataclasses import dataclass
from functools import cache
from math import cos, isfinite, radians, sin
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

if TYPE_CHECKING:
    from pyproj import Transformer


_WGS84_RADIUS_M = 6_378_137.0
_WGS84_E2 = (2 - 1 / 298.257223563) / 298.257223563  # first eccentricity, squared


@dataclass(frozen=True, slots=True)
class Geodetic:
    """A WGS84 place (EPSG:4979): degrees, and metres above the ellipsoid (not above the sea).

    Raises ValueError for a latitude beyond 90 or a longitude beyond 180 degrees.
    """

    lat_deg: float
    lon_deg: float
    height_m: float

    def __post_init__(self) -> None:
        if not -90 <= self.lat_deg <= 90:
            raise ValueError(f"lat_deg must lie between -90 and 90, got {self.lat_deg}")
        if not -180 <= self.lon_deg <= 180:
            raise ValueError(f"lon_deg must lie between -180 and 180, got {self.lon_deg}")
        if not isfinite(self.height_m):
            raise ValueError(f"height_m must be a finite number of metres, got {self.height_m}")


class WorldFrame(Protocol):
    """A right-handed metric frame fixed to the earth."""

    def position(self, lat_deg: float, lon_deg: float, height_m: float) -> FloatArray:
        """Metres in the world frame, shape (3,), of a WGS84 place."""
        ...

    def axes(self, lat_deg: float, lon_deg: float) -> FloatArray:
        """Rows east, north and up at a place as unit vectors of the world frame, shape (3, 3)."""
        ...

    def places(
        self, lat_deg: FloatArray, lon_deg: FloatArray, height_m: float | FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Positions (n, 3) and axes (n, 3, 3) of many WGS84 places (n,) of one height or (n,)."""
        ...

    def geodetic(self, point_in_world: npt.ArrayLike) -> Geodetic:
        """Give the WGS84 place of a point of the world frame, shape (3,)."""
        ...


class EcefFrame:
    """The geocentric frame EPSG:4978: z through the north pole, x through longitude 0."""

    def position(self, lat_deg: float, lon_deg: float, height_m: float) -> FloatArray:
        """Metres from the earth's centre, shape (3,)."""
        place = Geodetic(lat_deg, lon_deg, height_m)  # checks the ranges
        x, y, z = _ecef_from_geodetic().transform(place.lon_deg, place.lat_deg, place.height_m)
        return np.array([x, y, z], dtype=np.float64)

    def axes(self, lat_deg: float, lon_deg: float) -> FloatArray:
        """Rows east, north, up (ellipsoid normal) as geocentric unit vectors, shape (3, 3)."""
        lat, lon = radians(lat_deg), radians(lon_deg)
        return np.array(
            [
                [-sin(lon), cos(lon), 0.0],
                [-sin(lat) * cos(lon), -sin(lat) * sin(lon), cos(lat)],
                [cos(lat) * cos(lon), cos(lat) * sin(lon), sin(lat)],
            ],
            dtype=np.float64,
        )

    def places(
        self, lat_deg: FloatArray, lon_deg: FloatArray, height_m: float | FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Positions (n, 3) and axes (n, 3, 3) of many places at once (EPSG method 9602)."""
        lat, lon = np.radians(lat_deg), np.radians(lon_deg)
        sin_lat, cos_lat, sin_lon, cos_lon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
        axes = np.zeros((len(lat), 3, 3))
        axes[:, 0, 0], axes[:, 0, 1] = -sin_lon, cos_lon
        axes[:, 1, 0], axes[:, 1, 1] = -sin_lat * cos_lon, -sin_lat * sin_lon
        axes[:, 2, 0], axes[:, 2, 1] = cos_lat * cos_lon, cos_lat * sin_lon
        axes[:, 1, 2], axes[:, 2, 2] = cos_lat, sin_lat
        # The radius across the meridian: from the ellipsoid to the axis of the earth.
        across_m = _WGS84_RADIUS_M / np.sqrt(1 - _WGS84_E2 * sin_lat**2)
        positions = (across_m + height_m)[:, None] * axes[:, 2]
        positions[:, 2] -= _WGS84_E2 * across_m * sin_lat
        return positions, axes

    def geodetic(self, point_in_world: npt.ArrayLike) -> Geodetic:
        """WGS84 place of a geocentric point, shape (3,), metres."""
        x, y, z = np.asarray(point_in_world, dtype=np.float64)
        lon, lat, height = _geodetic_from_ecef().transform(x, y, z)
        return Geodetic(float(lat), float(lon), float(height))


class EnuFrame:
    """The tangent frame at `origin`: x east, y north, z up along the ellipsoid's normal there."""

    def __init__(self, origin: Geodetic) -> None:
        self.origin = origin
        self._ecef = EcefFrame()
        self.origin_in_ecef = self._ecef.position(origin.lat_deg, origin.lon_deg, origin.height_m)
        self.R_enu_from_ecef = self._ecef.axes(origin.lat_deg, origin.lon_deg)

    def position(self, lat_deg: float, lon_deg: float, height_m: float) -> FloatArray:
        """Metres east, north and up of the origin, shape (3,)."""
        in_ecef = self._ecef.position(lat_deg, lon_deg, height_m)
        return self.R_enu_from_ecef @ (in_ecef - self.origin_in_ecef)

    def axes(self, lat_deg: float, lon_deg: float) -> FloatArray:
        """Rows east, north, up of that place as unit vectors of this frame, shape (3, 3)."""
        return self._ecef.axes(lat_deg, lon_deg) @ self.R_enu_from_ecef.T

    def places(
        self, lat_deg: FloatArray, lon_deg: FloatArray, height_m: float | FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Positions (n, 3) and axes (n, 3, 3) of many places at once."""
        in_ecef, axes = self._ecef.places(lat_deg, lon_deg, height_m)
        R_ecef_from_enu = self.R_enu_from_ecef.T
        return (in_ecef - self.origin_in_ecef) @ R_ecef_from_enu, axes @ R_ecef_from_enu

    def geodetic(self, point_in_world: npt.ArrayLike) -> Geodetic:
        """WGS84 place of a point of this frame, shape (3,), metres."""
        in_enu = np.asarray(point_in_world, dtype=np.float64)
        return self._ecef.geodetic(self.R_enu_from_ecef.T @ in_enu + self.origin_in_ecef)


# PROJ takes a while to load and the web process seldom needs it, so both transformations are made
# at their first use and kept (pyproj's transformers may be shared between threads).
@cache
def _ecef_from_geodetic() -> "Transformer":
    from pyproj import Transformer  # noqa: PLC0415 - see above

    return Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)


@cache
def _geodetic_from_ecef() -> "Transformer":
    from pyproj import Transformer  # noqa: PLC0415 - see above

    return Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
