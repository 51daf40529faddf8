"""What the edges of a detection tell of a hull: its middle, its width and its lower edge.

Matching and the estimator weigh the same evidence. An edge that is the image's border says nothing;
the other side then counts alone, as in the paper, and there is no width. Hulls differ from the
outline that is projected and superstructures lean over their sides, so that even exact boxes are
off by a share of their size: the less, the more of the hull's shape is allowed for elsewhere.
"""

from typing import NamedTuple

import numpy as np

from app.domain.arrays import BoolArray, FloatArray


class Misfit(NamedTuple):
    """One sigma of what boxes and projected outlines differ by.

    `middle` and `width` in share of the box's width, `lower` of its height (detectors are less
    exact on large vessels); bow waves and dark boot tops hide `lower_edge_m` of the waterline.
    """

    middle: float
    width: float
    lower: float
    lower_edge_m: float


ONE_OUTLINE = Misfit(middle=0.012, width=0.12, lower=0.006, lower_edge_m=0.1)
# Where the evidence's own variance already tells how much hulls differ.
ANY_OUTLINE = Misfit(middle=0.006, width=0.06, lower=0.005, lower_edge_m=0.05)


def edge_mixing(seen: BoolArray, has_width: BoolArray | None = None) -> FloatArray:
    """Return how left, right and lower edges make up middle, width and lower edge, (n, 3, 3).

    `seen` (n, 3) tells which edges count; without `has_width` (n,) both sides give a width.
    """
    left, right, lower = seen.T.astype(np.float64)
    sides = np.maximum(1.0, left + right)
    width = left * right if has_width is None else left * right * has_width
    mixing = np.zeros((len(seen), 3, 3))
    mixing[:, 0, 0], mixing[:, 0, 1] = left / sides, right / sides
    mixing[:, 1, 0], mixing[:, 1, 1] = -width, width
    mixing[:, 2, 2] = lower
    return mixing


def edge_variance_px2(
    edge_sigma_px: float,
    size_px: FloatArray,
    px_per_m: FloatArray,
    one_side: BoolArray,
    misfit: Misfit = ONE_OUTLINE,
) -> FloatArray:
    """Return the variances (n, 3) of middle, width and lower edge of boxes of `size_px` (n, 2)."""
    width, height = size_px.T
    edge = edge_sigma_px**2
    middle = np.where(
        one_side,
        edge + (misfit.width / 2 * width) ** 2,
        edge / 2 + (misfit.middle * width) ** 2,
    )
    lower = (misfit.lower * height) ** 2 + (misfit.lower_edge_m * px_per_m) ** 2
    return np.column_stack([middle, 2 * edge + (misfit.width * width) ** 2, edge + lower])
