"""Many pose errors summed up, and whether poses know how far off they are.

A pose that says how sure it is can be asked whether it was right about that: the squared error in
units of its own covariance (NEES, Bar-Shalom) is three on average for three coordinates, and 95 %
of the errors lie within the 95 % ellipsoid. Fewer inside: it is too sure of itself.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.metrics import BoxPose
from app.domain.sampling import Share

# Chi-squared with two and three degrees of freedom: 95 % lie below.
WITHIN_95 = {2: 5.991465, 3: 7.814728}
Z_95 = 1.959964
DRAWS, SEED = 200, 1979


@dataclass(frozen=True, slots=True)
class ErrorSummary:
    """Errors by their absolute values, with the 95 % interval of the median; `bias` keeps signs.

    No interval where all errors are of one image.
    """

    count: int
    median: float
    median_interval: tuple[float, float] | None
    mean: float
    p95: float
    bias: float


@dataclass(frozen=True, slots=True)
class Calibration:
    """Of poses that say how sure they are: mean NEES and shares within their 95 %.

    The NEES of the whole position is 3 where they are right, that along the water 2.
    """

    mean_nees: float | None
    mean_nees_horizontal: float | None
    position: Share
    horizontal: Share
    heading: Share
    height: Share


def summary(errors: Sequence[float], groups: Sequence[int]) -> ErrorSummary | None:
    """Sum up errors; `groups` are their images, drawn anew for the interval. None for none."""
    if not errors:
        return None
    signed = np.asarray(errors, dtype=np.float64)
    values = np.abs(signed)
    return ErrorSummary(
        count=len(values),
        median=float(np.median(values)),
        median_interval=drawn_interval(values, groups, np.median),
        mean=float(values.mean()),
        p95=float(np.percentile(values, 95)),
        bias=float(signed.mean()),
    )


def drawn_interval(
    values: FloatArray,
    groups: Sequence[int],
    figure: Callable[[FloatArray], float | np.floating[Any]],
    draws: int = DRAWS,
) -> tuple[float, float] | None:
    """Return the 95 % interval of a figure of values (n), whole groups drawn anew (Efron 1979).

    None for one group alone, which says nothing of how others would differ.
    """
    _, group = np.unique(np.asarray(groups), return_inverse=True)
    if group.max(initial=0) == 0:
        return None
    order = np.argsort(group, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(group))[:-1])
    random = np.random.default_rng(SEED)
    found = [
        float(figure(values[np.concatenate([members[i] for i in chosen])]))
        for chosen in random.integers(len(members), size=(draws, len(members)))
    ]
    low, high = np.percentile(found, [2.5, 97.5])
    return float(low), float(high)


def error_in_enu_m(generated: BoxPose, true: BoxPose, heading_deg: float) -> FloatArray:
    """Return how far a pose's centroid is off (3,): east, north, up.

    The generated pose's own axes are known in the camera frame and, by its heading, on the map.
    """
    apart = np.asarray(generated.centroid_in_cam_m) - np.asarray(true.centroid_in_cam_m)
    east, north = sin(radians(heading_deg)), cos(radians(heading_deg))
    axes_in_enu = np.array([[east, -north, 0.0], [north, east, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(axes_in_enu @ (generated.axes_in_cam.T @ apart), dtype=np.float64)


def nees(error: FloatArray, covariance: npt.ArrayLike) -> float | None:
    """Return the squared error (k,) in units of a covariance (k, k); None for one that is none."""
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.shape != (len(error), len(error)) or not np.isfinite(matrix).all():
        return None
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    return float(error @ np.linalg.solve(matrix, error))


def calibration(
    nees_by_dimension: Mapping[int, Sequence[float]], sigmas: Mapping[str, Sequence[float]]
) -> Calibration:
    """Sum up NEES of positions (3) and along the water (2), and errors in sigmas.

    `sigmas` are those of `heading` and `height`.
    """
    inside = {
        dimension: Share(sum(value <= WITHIN_95[dimension] for value in values), len(values))
        for dimension, values in nees_by_dimension.items()
    }
    means = {
        dimension: float(np.mean(values)) if values else None
        for dimension, values in nees_by_dimension.items()
    }
    return Calibration(
        mean_nees=means[3],
        mean_nees_horizontal=means[2],
        position=inside[3],
        horizontal=inside[2],
        heading=_within(sigmas["heading"]),
        height=_within(sigmas["height"]),
    )


def _within(values: Sequence[float]) -> Share:
    return Share(sum(abs(value) <= Z_95 for value in values), len(values))
