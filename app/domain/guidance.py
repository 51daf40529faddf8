"""Where the next keypoint helps most.

A keypoint is worth what it tells of the water, because vessels stand there. Each part of the image
and each distance is tried: its derivatives are added to what the keypoints at hand already say, and
the uncertainty of water 300 m away is computed anew. The best place is told in words.
"""

from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Intrinsics
from app.domain.keypoints import Keypoints
from app.domain.projection import projection_jacobian
from app.domain.registration import Registration
from app.domain.water_view import WaterView

REFERENCE_RANGE_M = 300.0
_COLUMNS, _ROWS = 4, 3
_RANGES_M = (50.0, 100.0, 200.0, 400.0, 800.0, 1500.0)
_HALF_RANGE = 1.4  # from 200 m: "140 to 280 m"
_LOWEST_M, _HIGHEST_M = -1.0, 80.0  # above the water: what landmarks stand on
_WORTH_SAYING = 0.05
_REFERENCE_POINTS = 7
_LEAST_VARIANCE = 0.25  # nobody clicks better than half a pixel


@dataclass(frozen=True, slots=True)
class NextPoint:
    """The part of the image and the range in which a keypoint helps most.

    Sigmas are those of water 300 m away, before and with it; None while there is no camera.
    """

    box_px: tuple[float, float, float, float]
    range_m: tuple[float, float] | None
    sigma_before_px: float | None
    sigma_after_px: float | None
    sentence: str


def next_point(
    registration: Registration, keypoints: Keypoints, water: WaterView
) -> NextPoint | None:
    """Find the place for the next keypoint of a PnP registration; None when more help little."""
    covariance = registration.parameter_covariance
    if covariance is None:
        return None
    unknowns = len(covariance)
    references = projection_jacobian(water.camera, _reference_points(water))[:, :, :unknowns]
    before = _mean_sigma(references, covariance[None])[0]
    boxes, points, ranges = _candidates(water)
    if not len(points):
        return None
    J = projection_jacobian(water.camera, points)[:, :, :unknowns]
    variance = _variance(registration, keypoints, unknowns)
    information = np.linalg.inv(covariance) + np.swapaxes(J, 1, 2) @ J / variance
    after = _mean_sigma(references, np.asarray(np.linalg.inv(information), dtype=np.float64))
    best = int(np.argmin(after))
    if after[best] > (1 - _WORTH_SAYING) * before:
        return None
    near, far = ranges[best] / _HALF_RANGE, ranges[best] * _HALF_RANGE
    with_it, without = _told_apart(after[best], before)
    return NextPoint(
        box_px=boxes[best],
        range_m=(near, far),
        sigma_before_px=float(before),
        sigma_after_px=float(after[best]),
        sentence=(
            f"The next keypoint helps most in the {_part(boxes[best], registration.intrinsics)} of "
            f"the image, {_rounded(near)} to {_rounded(far)} m away: water 300 m away would be "
            f"sure to {with_it} px instead of {without} px."
        ),
    )


def _told_apart(after: float, before: float) -> tuple[str, str]:
    """Write two figures with as few decimals, at most three, as show that they differ."""
    for digits in (1, 2, 3):
        texts = f"{after:.{digits}f}", f"{before:.{digits}f}"
        if texts[0] != texts[1]:
            break
    return texts


def emptiest_part(keypoints: Keypoints, image: Intrinsics) -> NextPoint:
    """Name the part of the image that is farthest from all keypoints, without a camera."""
    boxes = _boxes(image)
    centres = np.array([[(box[0] + box[2]) / 2, (box[1] + box[3]) / 2] for box in boxes])
    distances = np.full(len(boxes), np.inf)
    for pixel in keypoints.pixels_px:
        distances = np.minimum(distances, np.linalg.norm(centres - pixel, axis=1))
    box = boxes[int(np.argmax(distances))]
    where = f"the {_part(box, image)} of the image" if len(keypoints) else "any part of the image"
    return NextPoint(box, None, None, None, f"Mark the next landmark in {where}; some near ones.")


def _reference_points(water: WaterView) -> FloatArray:
    """Water points 300 m away, across the image's width."""
    image = water.camera.intrinsics
    u = np.linspace(0, image.width_px - 1, _REFERENCE_POINTS)
    middle = np.column_stack([u, np.full_like(u, (image.height_px - 1) / 2)])
    east, north, _ = (water.camera.rays(middle) @ water.axes.T).T
    ahead = np.isfinite(east)
    return water.points(REFERENCE_RANGE_M, np.degrees(np.arctan2(east[ahead], north[ahead])))


def _mean_sigma(references: FloatArray, covariances: FloatArray) -> FloatArray:
    """Mean worst sigma (B,) of the reference points for each covariance (B, p, p)."""
    in_px = references[None] @ covariances[:, None] @ np.swapaxes(references, 1, 2)[None]
    worst = np.sqrt(np.maximum(np.linalg.eigvalsh(in_px)[..., -1], 0))
    return np.asarray(worst.mean(axis=1), dtype=np.float64)


def _candidates(
    water: WaterView,
) -> tuple[list[tuple[float, float, float, float]], FloatArray, list[float]]:
    """Places for a keypoint: the boxes' centres at each range where landmarks may stand."""
    boxes, points, ranges = [], [], []
    for box in _boxes(water.camera.intrinsics):
        centre = np.array([[(box[0] + box[2]) / 2, (box[1] + box[3]) / 2]])
        ray = water.camera.rays(centre)[0]
        up = float(ray @ water.axes[2])
        for range_m in _RANGES_M:
            if _LOWEST_M <= water.height_m + up * range_m <= _HIGHEST_M:
                boxes.append(box)
                points.append(water.camera.center_in_world + ray * range_m)
                ranges.append(range_m)
    return boxes, np.array(points).reshape(-1, 3), ranges


def _boxes(image: Intrinsics) -> list[tuple[float, float, float, float]]:
    width, height = image.width_px / _COLUMNS, image.height_px / _ROWS
    return [
        (c * width - 0.5, r * height - 0.5, (c + 1) * width - 0.5, (r + 1) * height - 0.5)
        for r in range(_ROWS)
        for c in range(_COLUMNS)
    ]


def _variance(registration: Registration, keypoints: Keypoints, unknowns: int) -> float:
    used = registration.residuals_px[registration.inliers]
    freedom = max(2 * len(used) - unknowns, 1)
    return max(float((used**2).sum()) / freedom, _LEAST_VARIANCE) if len(keypoints) else 1.0


def _part(box: tuple[float, float, float, float], image: Intrinsics) -> str:
    """Name a part of the image in words."""
    across = ((box[0] + box[2]) / 2 + 0.5) / image.width_px
    down = ((box[1] + box[3]) / 2 + 0.5) / image.height_px
    side = "left" if across < 1 / 3 else "right" if across > 2 / 3 else "middle"
    level = "upper " if down < 1 / 3 else "lower " if down > 2 / 3 else ""
    return f"{level}{side} part" if side != "middle" or level else "middle"


def _rounded(metres: float) -> int:
    step = 10 if metres < 300 else 50 if metres < 1000 else 100
    return round(metres / step) * step
