"""Which edges of a detection are the vessel's, and which are only the image's border.

A vessel that leaves the image is cut by the border: that edge of its box says nothing about the
vessel. Matching then stops comparing widths and correction drops the plane of the cut edge.
"""

from collections.abc import Sequence
from math import hypot
from typing import NamedTuple

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Intrinsics
from app.domain.detection import Detection

# Edges of boxes are off by a share of the box too; hulls are narrower than their rectangles.
_NEAR_SIGMAS, _EDGE_SHARE, _HULL_SHARE = 3.0, 0.012, 0.15


class CutEdges(NamedTuple):
    """The borders of the image that a detection touches."""

    left: bool
    right: bool
    top: bool
    bottom: bool

    @property
    def sideways(self) -> bool:
        """Whether the width of the box is not the vessel's."""
        return self.left or self.right


def cut_edges(detection: Detection, intrinsics: Intrinsics, tolerance_px: float) -> CutEdges:
    """Find the borders within `tolerance_px` of the box, counted from the outermost pixels."""
    return CutEdges(
        left=detection.x1_px <= tolerance_px,
        right=detection.x2_px >= intrinsics.width_px - 1 - tolerance_px,
        top=detection.y1_px <= tolerance_px,
        bottom=detection.y2_px >= intrinsics.height_px - 1 - tolerance_px,
    )


def cut_like(
    cut: CutEdges,
    detection: Detection,
    expected_px: Sequence[float],
    intrinsics: Intrinsics,
    edge_sigma_px: float,
) -> CutEdges:
    """Add the borders that a box misses only by the detector's error.

    A detector's box of a vessel that leaves the image often ends some pixels before the border. It
    is cut when it ends so near, and the vessel `expected_px` (x1, y1, x2, y2) by AIS goes on: is
    wider than the box by more than boxes err, or lies lower than the image's border.
    """
    x1, _, x2, y2 = expected_px
    width_px, height_px = detection.x2_px - detection.x1_px, detection.y2_px - detection.y1_px
    if x2 - x1 <= width_px and y2 <= intrinsics.height_px:
        return cut
    aside_px = _NEAR_SIGMAS * hypot(edge_sigma_px, _EDGE_SHARE * width_px)
    below_px = _NEAR_SIGMAS * hypot(edge_sigma_px, _EDGE_SHARE * height_px)
    is_narrow = x2 - x1 - width_px > max(aside_px, _HULL_SHARE * (x2 - x1))
    is_high = y2 - intrinsics.height_px > below_px
    if not (is_narrow or is_high):
        return cut
    aside = cut_edges(detection, intrinsics, aside_px)
    return CutEdges(
        left=cut.left or (is_narrow and aside.left),
        right=cut.right or (is_narrow and aside.right),
        top=cut.top,
        bottom=cut.bottom or (is_high and cut_edges(detection, intrinsics, below_px).bottom),
    )


def cut_sides(
    edges_px: Sequence[FloatArray], intrinsics: Intrinsics, tolerance_px: float
) -> BoolArray:
    """Return what `cut_edges` says of many boxes: left, upper, right and lower edge (4, ...).

    `edges_px` are x1, y1, x2 and y2, each (...).
    """
    x1, y1, x2, y2 = edges_px
    return np.array(
        [
            x1 <= tolerance_px,
            y1 <= tolerance_px,
            x2 >= intrinsics.width_px - 1 - tolerance_px,
            y2 >= intrinsics.height_px - 1 - tolerance_px,
        ]
    )
