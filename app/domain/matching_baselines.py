"""How related systems decide which detection shows which vessel, to be compared with.

Both take the middle of a detection's lower edge for a point on the water. Lu et al. (2021) compare
its distance and bearing with those of each vessel and give every detection its nearest one within
thresholds. Carrillo-Perez et al. (2022) and Gülsoylu et al. (2024) map the point to the water by a
homography and assign by metres there; the homography is the one that the registered camera makes of
the water's plane, so that registrations do not differ between methods. Thresholds are ours, chosen
for the fewest errors on the simulated harbour: the publications leave them to their sites.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.detection import HALF_PIXEL, Detection
from app.domain.fusion_settings import FusionSettings, MatchingMethod

FARTHEST_SHARE = 0.25  # of the vessel's distance
FARTHEST_DEG = 2.0
FARTHEST_M = 60.0
_IMPOSSIBLE = 1e9


@dataclass(frozen=True, slots=True)
class GroundCost:
    """How far a detection's point on the water is from a vessel, and that in share of the limit."""

    total: float
    distance_m: float
    bearing_deg: float

    def terms(self) -> dict[str, float]:
        """Name what counted, for people to read."""
        return {"distance_m": self.distance_m, "bearing_deg": self.bearing_deg}


@dataclass(frozen=True, slots=True)
class GroundPair:
    """A detection and a candidate (positions in the lists given), with their cost."""

    detection: int
    candidate: int
    cost: GroundCost


def match_on_water(
    detections: Sequence[Detection],
    candidates: Sequence[Candidate],
    camera: Camera,
    settings: FusionSettings,
) -> list[GroundPair]:
    """Match by `lu_2021` or `ground_plane`; pairs in the order of detections, costs of at most 1.

    Detections below the score threshold take no part.
    """
    taking_part = [i for i, d in enumerate(detections) if d.score >= settings.score_threshold]
    if not taking_part or not candidates:
        return []
    there = OnWater.of([detections[i] for i in taking_part], candidates, camera)
    nearest = settings.matching is MatchingMethod.LU_2021
    weights = (
        np.maximum(there.share_of_range / FARTHEST_SHARE, there.bearing_deg / FARTHEST_DEG)
        if nearest
        else there.distance_m / FARTHEST_M
    )
    chosen = _greedy(weights) if nearest else _assigned(weights)
    return [
        GroundPair(taking_part[row], column, there.cost(row, column, weights[row, column]))
        for row, column in sorted(chosen)
        if weights[row, column] <= 1
    ]


@dataclass(frozen=True, slots=True, eq=False)
class OnWater:
    """Where d detections stand on the water against c vessels; endless where not on the water.

    `off_m` (d, c, 2) is east and north of the vessel's middle; the others are (d, c).
    """

    off_m: FloatArray
    distance_m: FloatArray
    bearing_deg: FloatArray
    share_of_range: FloatArray

    @classmethod
    def of(
        cls, detections: Sequence[Detection], candidates: Sequence[Candidate], camera: Camera
    ) -> "OnWater":
        """Meet the water at each vessel's level with the lines of sight to lower edges."""
        lower = np.array([((d.x1_px + d.x2_px) / 2, d.y2_px) for d in detections]) - HALF_PIXEL
        segments = [candidate.segment for candidate in candidates]
        enu = np.array([s.enu_axes_in_world for s in segments]).reshape(-1, 3, 3)
        middle = np.array([s.corners_in_world for s in segments]).reshape(-1, 4, 3).mean(axis=1)
        vessel = (enu @ (middle - camera.center_in_world)[..., None])[..., 0]
        direction = np.einsum("cij,dj->dci", enu, camera.rays(lower))
        meets = direction[..., 2] * vessel[:, 2] > 0
        far = vessel[:, 2] / np.where(meets, direction[..., 2], vessel[:, 2])
        point = (direction * far[..., None])[..., :2]
        off = point - vessel[:, :2]
        turn = np.degrees(
            np.arctan2(point[..., 0], point[..., 1]) - np.arctan2(vessel[:, 0], vessel[:, 1])
        )
        away = np.hypot(*vessel[:, :2].T)
        share = np.abs(np.hypot(point[..., 0], point[..., 1]) - away) / away
        return cls(
            off_m=np.where(meets[..., None], off, np.inf),
            distance_m=np.where(meets, np.hypot(off[..., 0], off[..., 1]), np.inf),
            bearing_deg=np.where(meets, np.abs((turn + 180) % 360 - 180), 180.0),
            share_of_range=np.where(meets, share, np.inf),
        )

    def cost(self, row: int, column: int, total: float) -> GroundCost:
        """Return what one pair costs, with how far apart its ends are."""
        return GroundCost(
            float(total), float(self.distance_m[row, column]), float(self.bearing_deg[row, column])
        )


def _greedy(weights: FloatArray) -> list[tuple[int, int]]:
    """Take the nearest pair of all, then the nearest of what is left."""
    left = weights.copy()
    chosen = []
    for _ in range(min(left.shape)):
        row, column = np.unravel_index(np.argmin(left), left.shape)
        if not np.isfinite(left[row, column]):
            break
        chosen.append((int(row), int(column)))
        left[row, :] = left[:, column] = np.inf
    return chosen


def _assigned(weights: FloatArray) -> list[tuple[int, int]]:
    """Take the assignment with the least sum."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - keeps the web process small

    rows, columns = linear_sum_assignment(np.minimum(weights, _IMPOSSIBLE))
    return [(int(row), int(column)) for row, column in zip(rows, columns, strict=True)]
