"""A busy fairway for measuring: ships on twelve lanes, and boxes on photographs that nobody took.

On each lane a ship crosses the camera's view, then another, for as many hours as wanted. What a
detector would have found are the projected hulls, some pixels off.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.sighting import SeenImage
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane

LANES = 12
WATER_M = 40.0
HEIGHT_M = 30.0  # of the camera above the water
ORIGIN = Geodetic(53.5422, 9.9835, WATER_M)
_WAY_M = 2000.0  # from where a ship comes into range to where it leaves
_NEAREST_M, _FARTHEST_M = 250.0, 900.0
_SIZE_PX = (2560, 1920)
_FIELD_OF_VIEW_DEG = 60.0
_BOX_SIGMA_PX = 1.5
_KN = 1852 / 3600
_M_PER_DEG = 111_300


@dataclass(frozen=True, slots=True)
class Lane:
    """Ships of one lane: how far off and fast they pass, since when, and their size."""

    number: int
    away_m: float
    speed_kn: float
    since_s: float
    length_m: float
    width_m: float
    height_m: float

    def state(self, at_s: float) -> VesselState:
        """Return the ship under way in this lane at a moment."""
        passed, along_m = divmod((at_s + self.since_s) * self.speed_kn * _KN, _WAY_M)
        east_m = (along_m - _WAY_M / 2) * (1 if self.number % 2 else -1)
        lat_deg = ORIGIN.lat_deg + self.away_m / _M_PER_DEG
        return VesselState(
            identifier=str(211_000_000 + 10_000 * self.number + int(passed)),
            lat_deg=lat_deg,
            lon_deg=ORIGIN.lon_deg + east_m / (_M_PER_DEG * cos(radians(lat_deg))),
            heading_deg=90.0 if self.number % 2 else 270.0,
            speed_kn=self.speed_kn,
            age_s=0.0,
            to_bow_m=round(0.7 * self.length_m),
            to_stern_m=round(0.3 * self.length_m),
            to_port_m=round(self.width_m / 2),
            to_starboard_m=round(self.width_m / 2),
        )


@dataclass(frozen=True, eq=False)
class Fairway:
    """The lanes, and a camera over them. Moments are seconds from any one."""

    lanes: Sequence[Lane]
    camera: Camera
    frame: EnuFrame
    rng: np.random.Generator

    @classmethod
    def of(cls, seed: int) -> "Fairway":
        """Draw the lanes."""
        rng = np.random.default_rng(seed)
        lanes = [
            Lane(
                number=number,
                away_m=float(away_m),
                speed_kn=float(rng.uniform(6, 14)),
                since_s=float(rng.uniform(0, 600)),
                length_m=float(rng.uniform(15, 110)),
                width_m=float(rng.uniform(5, 16)),
                height_m=float(rng.uniform(4, 18)),
            )
            for number, away_m in enumerate(np.linspace(_NEAREST_M, _FARTHEST_M, LANES))
        ]
        return cls(lanes, _camera(), EnuFrame(ORIGIN), rng)

    def image(self, at_s: float) -> SeenImage:
        """Return a photograph of a moment as fusion takes it, with the ships as they are."""
        states = [lane.state(at_s) for lane in self.lanes]
        plane = water_plane(self.frame, WATER_M, states)
        up = plane.vessel_axes_in_world[:, None, 2]
        high_m = np.array([lane.height_m for lane in self.lanes])[:, None, None]
        bottom = plane.corners_in_world
        hulls = np.concatenate([bottom, bottom + high_m * up], axis=1)
        boxes = self._boxes(self.camera.project(hulls).reshape(len(states), 8, 2))
        return SeenImage(list(boxes), states, WATER_M, at_s)

    def _boxes(self, hulls_px: FloatArray) -> Iterator[Detection]:
        for hull in hulls_px[np.isfinite(hulls_px).all(axis=(1, 2))]:
            off = self.rng.normal(0, _BOX_SIGMA_PX, (2, 2))
            x1, y1 = np.clip(hull.min(axis=0) + off[0], 0, _SIZE_PX).tolist()
            x2, y2 = np.clip(hull.max(axis=0) + off[1], 0, _SIZE_PX).tolist()
            if x2 - x1 > 8 and y2 - y1 > 4:
                yield Detection(x1, y1, x2, y2, float(self.rng.uniform(0.4, 1)))


def _camera() -> Camera:
    width, height = _SIZE_PX
    focal = width / 2 / np.tan(np.radians(_FIELD_OF_VIEW_DEG) / 2)
    K = np.array([[focal, 0, width / 2 - 0.5], [0, focal, height / 2 - 0.5], [0, 0, 1.0]])
    down = np.radians(4.0)
    right, forward = np.array([1.0, 0, 0]), np.array([0, np.cos(down), -np.sin(down)])
    R = np.array([right, np.cross(forward, right), forward])
    return Camera(Intrinsics(width, height, K), R, np.array([0.0, 0.0, HEIGHT_M]))
