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

    `middle` and `width` in share of the box's width, `lower` of its height; `one_side` is that of
    the middle where one side and the width by AIS tell it. Bow waves and dark boot tops hide
    `lower_edge_m` of the waterline.
    """

    middle: float
    width: float
    one_side: float
    lower: float
    lower_edge_m: float


ONE_OUTLINE = Misfit(middle=0.012, width=0.12, one_side=0.06, lower=0.006, lower_edge_m=0.1)
# Where the evidence's own variance already tells how much hulls differ, and that of boxes how much
# detectors do.
ANY_OUTLINE = Misfit(middle=0.004, width=0.025, one_side=0.02, lower=0.0045, lower_edge_m=0.05)


class EdgeShares(NamedTuple):
    """How much left, right and lower edges (n,) make up middle, width and lower edge."""

    left: FloatArray
    right: FloatArray
    width: FloatArray
    lower: FloatArray

    @classmethod
    def of(cls, seen: BoolArray, has_width: BoolArray | None = None) -> "EdgeShares":
        """Take the edges that count, `seen` (3, n); without `has_width` (n,) sides give a width."""
        left, right, lower = seen.astype(np.float64)
        sides = np.maximum(1.0, left + right)
        width = left * right if has_width is None else left * right * has_width
        return cls(left / sides, right / sides, width, lower)

    def mixed(self, edges: FloatArray) -> FloatArray:
        """Make middle, width and lower edge (3, ..., n) of what edges (3, ..., n) have."""
        left, right, lower = edges
        mixed = np.empty_like(edges)
        mixed[0] = self.left * left + self.right * right
        mixed[1] = self.width * (right - left)
        mixed[2] = self.lower * lower
        return mixed

    def weights(self) -> FloatArray:
        """Return how much each edge (columns) has part in the evidence (rows), (3, 3, n)."""
        weights = np.zeros((3, 3, len(self.left)))
        weights[0, 0], weights[0, 1] = self.left, self.right
        weights[1, 0], weights[1, 1] = -self.width, self.width
        weights[2, 2] = self.lower
        return weights

    @property
    def used(self) -> BoolArray:
        """Which of middle, width and lower edge count, (3, n)."""
        return np.array([self.left + self.right > 0, self.width > 0, self.lower > 0])


def edge_variance_px2(
    edge_sigma_px: float, size_px: FloatArray, px_per_m: FloatArray, one_side: BoolArray
) -> FloatArray:
    """Return the variances (3, n) of middle, width and lower edge of boxes of `size_px` (2, n)."""
    by_boxes = box_variance_px2(np.full_like(size_px, edge_sigma_px**2), one_side)
    return by_boxes + misfit_variance_px2(size_px, px_per_m, one_side, ONE_OUTLINE)


def box_variance_px2(edge_px2: FloatArray, one_side: BoolArray) -> FloatArray:
    """Make variances (3, ..., n) of the evidence of those of side and lower edges (2, ..., n)."""
    side, lower = edge_px2
    return np.array([np.where(one_side, side, side / 2), 2 * side, lower])


def misfit_variance_px2(
    size_px: FloatArray, px_per_m: FloatArray, one_side: BoolArray, misfit: Misfit
) -> FloatArray:
    """Return the part (3, n) of the variances by which outlines differ from hulls."""
    width, height = size_px
    middle = np.where(one_side, misfit.one_side, misfit.middle) * width
    lower = (misfit.lower * height) ** 2 + (misfit.lower_edge_m * px_per_m) ** 2
    return np.array([middle**2, (misfit.width * width) ** 2, lower])
