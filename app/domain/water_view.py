"""The water as a registered camera sees it: horizon, ranges, bearings, and how sure each pixel is.

A registration is believed when its horizon lies on the horizon and its 300 m line on the quay that
is 300 m away. The earth is round and the air bends light: at 2 km the water is 0.3 m lower than the
tangent plane has it, and seems 13 % less so. Both are in the effective radius of the earth.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame
from app.domain.projection import projection_jacobian

EARTH_RADIUS_M = 6_371_000.0
REFRACTION = 0.13  # share of the curvature that standard air takes back
EFFECTIVE_RADIUS_M = EARTH_RADIUS_M / (1 - REFRACTION)
_RANGES_M = (10, 20, 30, 50, 75, 100, 150, 200, 300, 500, 750, 1000, 1500, 2000, 3000, 5000, 10000)
_BEARING_STEPS_DEG = (1, 2, 5, 10, 20, 30)
_FINE_DEG = 0.25
_LEAST_APART_PX = 28.0
_MOST_BEARINGS = 8
_HEAT_COLUMNS, _HEAT_ROWS = 32, 24

Line = list[list[float]]


@dataclass(frozen=True, eq=False)
class GridLine:
    """A line of equal range (m) or bearing (deg, clockwise from north) on the water, in pixels."""

    kind: str
    value: float
    lines: list[Line]
    label_px: list[float] | None


@dataclass(frozen=True, eq=False)
class HeatMap:
    """What one sigma of the registration means on the water, cell by cell (rows, columns).

    Along the worst direction, in pixels and in metres on the water; NaN where no water is seen.
    """

    cell_px: tuple[float, float]
    sigma_px: FloatArray
    sigma_m: FloatArray
    range_m: FloatArray


@dataclass(frozen=True, eq=False)
class WaterView:
    """A camera over water: `axes` are the rows E, N, U at the camera, `height_m` above the water.

    Raises ValueError for a camera that is not above the water.
    """

    camera: Camera
    axes: FloatArray
    height_m: float

    def __post_init__(self) -> None:
        if self.height_m <= 0:
            raise ValueError("the camera is not above the water")

    @classmethod
    def of(cls, camera: Camera, frame: EnuFrame, water_level_m: float) -> "WaterView":
        """Place a camera above water whose level is an ellipsoidal height."""
        place = frame.geodetic(camera.center_in_world)
        return cls(camera, frame.axes(place.lat_deg, place.lon_deg), place.height_m - water_level_m)

    @property
    def horizon_m(self) -> float:
        """How far the horizon is, along the water."""
        return sqrt(2 * EFFECTIVE_RADIUS_M * self.height_m)

    def points(self, range_m: npt.ArrayLike, bearing_deg: npt.ArrayLike) -> FloatArray:
        """Place water points (n, 3) in the world frame, where the bent light shows them."""
        ranges, bearings = np.broadcast_arrays(
            np.asarray(range_m, dtype=np.float64), np.radians(bearing_deg)
        )
        below = self.height_m + ranges**2 / (2 * EFFECTIVE_RADIUS_M)
        local = np.stack([ranges * np.sin(bearings), ranges * np.cos(bearings), -below], axis=-1)
        points: FloatArray = self.camera.center_in_world + local.reshape(-1, 3) @ self.axes
        return points

    def seen_at(self, pixels_px: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Ranges (n,) and bearings (n,) of the water seen at pixels (n, 2); NaN above it."""
        east, north, up = (self.camera.rays(pixels_px) @ self.axes.T).T
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = -up / np.hypot(east, north)
            root = np.sqrt(slope**2 - 2 * self.height_m / EFFECTIVE_RADIUS_M)
            # The nearer crossing, written so that no digits cancel.
            ranges = 2 * self.height_m / (slope + root)
        ranges[~(slope > 0)] = np.nan
        return ranges, np.degrees(np.arctan2(east, north)) % 360

    def horizon(self) -> list[Line]:
        """Draw the horizon: its lines in the image."""
        return self._seen(self.points(self.horizon_m, _circle()))

    def grid(self) -> list[GridLine]:
        """Lines of equal range and of equal bearing that the image shows, not too close."""
        return [*self._range_lines(), *self._bearing_lines()]

    def heat_map(self, covariance: FloatArray) -> HeatMap:
        """Uncertainty of the water from a covariance (6, 6) or (8, 8) of the registration."""
        image = self.camera.intrinsics
        cell = (image.width_px / _HEAT_COLUMNS, image.height_px / _HEAT_ROWS)
        u = (np.arange(_HEAT_COLUMNS) + 0.5) * cell[0] - 0.5
        v = (np.arange(_HEAT_ROWS) + 0.5) * cell[1] - 0.5
        pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
        ranges, bearings = self.seen_at(pixels)
        sigma_px, sigma_m = np.full(len(pixels), np.nan), np.full(len(pixels), np.nan)
        wet = np.isfinite(ranges)
        if wet.any():
            points = self.points(ranges[wet], bearings[wet])
            sigma_px[wet], sigma_m[wet] = self.sigmas(points, covariance)
        shape = (_HEAT_ROWS, _HEAT_COLUMNS)
        return HeatMap(cell, sigma_px.reshape(shape), sigma_m.reshape(shape), ranges.reshape(shape))

    def sigmas(self, points: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """One sigma of water points (n, 3) along the worst direction: pixels (n,), metres (n,)."""
        J = projection_jacobian(self.camera, points)
        by_unknowns = J[:, :, : len(covariance)]
        in_px = by_unknowns @ covariance @ np.swapaxes(by_unknowns, 1, 2)
        # Moving a point is moving the camera the other way; the water spans east and north.
        by_water = -J[:, :, 3:6] @ self.axes[:2].T
        back = np.linalg.pinv(by_water)
        in_m = back @ in_px @ np.swapaxes(back, 1, 2)
        px, m = (np.sqrt(np.maximum(np.linalg.eigvalsh(one)[:, -1], 0)) for one in (in_px, in_m))
        return px, m

    def _range_lines(self) -> list[GridLine]:
        lines: list[GridLine] = []
        last: FloatArray | None = None
        for range_m in reversed(_RANGES_M):
            if range_m >= self.horizon_m:
                continue
            points = self.points(range_m, _circle())
            seen = self._seen(points)
            label = self._label(seen)
            if label is None:
                continue
            if last is not None and np.linalg.norm(label - last) < _LEAST_APART_PX:
                continue
            last = label
            lines.append(GridLine("range", float(range_m), seen, label.tolist()))
        return lines[::-1]

    def _bearing_lines(self) -> list[GridLine]:
        ranges = np.geomspace(10, self.horizon_m, 60)
        bearings = np.arange(360.0)
        points = self.points(np.tile(ranges, 360), np.repeat(bearings, 60))
        visible = bearings[self._inside(self.camera.project(points)).reshape(360, 60).any(axis=1)]
        steps = (
            step for step in _BEARING_STEPS_DEG if (visible % step == 0).sum() <= _MOST_BEARINGS
        )
        step_deg = next(steps, _BEARING_STEPS_DEG[-1])
        lines = []
        for bearing_deg in visible[visible % step_deg == 0]:
            seen = self._seen(self.points(ranges, bearing_deg))
            label = self._label(seen)
            if label is not None:
                lines.append(GridLine("bearing", float(bearing_deg), seen, label.tolist()))
        return lines

    def _inside(self, pixels: FloatArray) -> npt.NDArray[np.bool_]:
        """Whether pixels (n, 2) lie in the image."""
        size = (self.camera.intrinsics.width_px, self.camera.intrinsics.height_px)
        return np.asarray(((pixels >= 0) & (pixels < size)).all(axis=1))

    def _seen(self, points: FloatArray) -> list[Line]:
        """Project a line (n, 3) and keep the parts within half an image around the image."""
        image = self.camera.intrinsics
        pixels = self.camera.project(points)
        size = np.array([image.width_px, image.height_px])
        kept = ((pixels >= -size / 2) & (pixels <= 1.5 * size)).all(axis=1)
        if not self._inside(pixels).any():
            return []
        edges = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(int)))
        return [
            pixels[begin:end].round(2).tolist()
            for begin, end in zip(edges[::2], edges[1::2], strict=True)
            if end - begin > 1
        ]

    def _label(self, lines: list[Line]) -> FloatArray | None:
        """Where a line's name fits: its rightmost point inside the image."""
        if not lines:
            return None
        pixels = np.concatenate([np.array(line) for line in lines])
        inside = pixels[self._inside(pixels)]
        return inside[np.argmax(inside[:, 0])] if len(inside) else None


def _circle() -> FloatArray:
    return np.arange(0, 360 + _FINE_DEG, _FINE_DEG)
