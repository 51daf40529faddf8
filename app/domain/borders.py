"""Which edges of a detection are the vessel's, and which are only the image's border.

A vessel that leaves the image is cut by the border: that edge of its box says nothing about the
vessel. Matching then stops comparing widths and correction drops the plane of the cut edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Intrinsics
from app.domain.detection import Detection


@dataclass(frozen=True, slots=True)
class CutEdges:
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


def cut_sides(
    edges_px: Sequence[FloatArray], intrinsics: Intrinsics, tolerance_px: float
) -> BoolArray:
    """Return what `cut_edges` says of many boxes: left, upper, right and lower edge (4, ...).

    `edges_px` are x1, y1, x2 and y2, each (...).
    """
    x1, y1, x2, y2 = edges_px
    return np.stack(
        [
            x1 <= tolerance_px,
            y1 <= tolerance_px,
            x2 >= intrinsics.width_px - 1 - tolerance_px,
            y2 >= intrinsics.height_px - 1 - tolerance_px,
        ]
    )
