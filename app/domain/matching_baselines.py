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
    nearest = settings.matching is MatchingMethod.LU_2021
    rows = [
        [_cost(detections[i], candidate, camera, nearest=nearest) for candidate in candidates]
        for i in taking_part
    ]
    weights = np.array([[cost.total for cost in row] for row in rows])
    chosen = _greedy(weights) if nearest else _assigned(weights)
    return [
        GroundPair(taking_part[row], column, rows[row][column])
        for row, column in sorted(chosen)
        if weights[row, column] <= 1
    ]


@dataclass(frozen=True, slots=True, eq=False)
class OnWater:
    """Where a detection stands on the water against a vessel: `off_m` (2,) is east and north."""

    off_m: FloatArray
    distance_m: float
    bearing_deg: float
    share_of_range: float


def on_water(detection: Detection, candidate: Candidate, camera: Camera) -> OnWater | None:
    """Meet the water at a vessel's level with the line of sight to a detection's lower edge.

    None where they do not meet.
    """
    middle = np.array([(detection.x1_px + detection.x2_px) / 2, detection.y2_px]) - HALF_PIXEL
    enu = candidate.segment.enu_axes_in_world
    vessel = enu @ (candidate.segment.corners_in_world.mean(axis=0) - camera.center_in_world)
    direction = enu @ camera.rays(middle[None])[0]
    if not direction[2] * vessel[2] > 0:
        return None
    point = direction * (vessel[2] / direction[2])
    off = (point - vessel)[:2]
    turn = np.degrees(np.arctan2(point[0], point[1]) - np.arctan2(vessel[0], vessel[1]))
    away_m = float(np.hypot(*vessel[:2]))
    return OnWater(
        off_m=off,
        distance_m=float(np.hypot(*off)),
        bearing_deg=float(abs((turn + 180) % 360 - 180)),
        share_of_range=abs(float(np.hypot(*point[:2])) - away_m) / away_m,
    )


def _cost(
    detection: Detection, candidate: Candidate, camera: Camera, *, nearest: bool
) -> GroundCost:
    """Compare a detection with a vessel; endless where it is not on the water."""
    there = on_water(detection, candidate, camera)
    if there is None:
        return GroundCost(float("inf"), float("inf"), 180.0)
    total = there.distance_m / FARTHEST_M
    if nearest:
        total = max(there.share_of_range / FARTHEST_SHARE, there.bearing_deg / FARTHEST_DEG)
    return GroundCost(total, there.distance_m, there.bearing_deg)


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
