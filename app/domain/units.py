"""Several boxes that may be one unit: a tug and its barges sail under one AIS, the tug's.

A detector sees a convoy as one box, as a box for each hull, or as both. Boxes side by side on one
waterline may be the hulls of one unit, which is then as long as the AIS says; a box within another
on the same waterline may be a part of it, and a part carries no AIS of another vessel. A boat in
front of a ship is none: its lower edge is lower down.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.detection import Detection

MOST_HULLS = 6
_GAP_SHARE = 0.25  # of the lower hull's height, between hulls side by side
_GAP_PX = 3.0
_OVERLAP_SHARE = 0.2  # of the shorter hull's length
# A waterline seen at an angle rises along the unit.
_RISE_SHARE = 0.1  # of both boxes' width
_RISE_PX = 4.0
_WITHIN_SHARE = 0.85  # of the part's area
_WATERLINE_SHARE = 0.08  # of the whole's height or width
_PART_SHARE = 0.9  # of the whole's width: a larger box is the same ship seen twice


def edges_of(detections: Sequence[Detection]) -> FloatArray:
    """Return left, upper, right and lower edges (n, 4) of detections."""
    return np.array([d.edges_px for d in detections]).reshape(-1, 4)


def rows_of_hulls(
    detections: Sequence[Detection], after: BoolArray
) -> Iterator[tuple[Detection, tuple[int, ...]]]:
    """Yield boxes around two or more detections of an image that may be one unit, and which.

    `after` (n, n) tells which is the next hull of which, as `side_by_side` has it.
    """
    following: list[int] = np.where(after.any(axis=1), after.argmax(axis=1), -1).tolist()
    for first in range(len(detections)):
        row = [first]
        while len(row) < MOST_HULLS and following[row[-1]] >= 0:
            row.append(following[row[-1]])
            yield _around([detections[i] for i in row]), tuple(row)


def side_by_side(boxes_px: FloatArray) -> BoolArray:
    """Return which box (rows) has which other (columns) as the next hull on its right, (..., n, n).

    Boxes (..., n, 4) are those of one image, or of several; a box of NaN is none.
    """
    x1, y1, x2, y2 = _columns(boxes_px)
    wide, high = x2 - x1, y2 - y1
    gap = x1 - _rows(x2)
    low = np.minimum(_rows(high), high)
    short = np.minimum(_rows(wide), wide)
    rise = np.abs(_rows(y2) - y2)
    return np.asarray(
        (_rows(x1) < x1)
        & (gap <= _GAP_PX + _GAP_SHARE * low)
        & (gap >= -_GAP_PX - _OVERLAP_SHARE * short)
        & (rise <= _RISE_PX + _RISE_SHARE * (_rows(wide) + wide))
    )


def _columns(boxes_px: FloatArray) -> Iterator[FloatArray]:
    """Yield each edge (..., 1, n) of boxes (..., n, 4)."""
    return (boxes_px[..., None, :, edge] for edge in range(4))


def _rows(columns: FloatArray) -> FloatArray:
    """Return values of columns (..., 1, n) as those of rows (..., n, 1)."""
    return columns.swapaxes(-1, -2)


def _around(hulls: Sequence[Detection]) -> Detection:
    return Detection(
        min(hull.x1_px for hull in hulls),
        min(hull.y1_px for hull in hulls),
        max(hull.x2_px for hull in hulls),
        max(hull.y2_px for hull in hulls),
        max(hull.score for hull in hulls),
        hulls[0].class_id,
    )


def parts_of(boxes_px: FloatArray) -> BoolArray:
    """Return which box (rows) may be a part of which other (columns) of an image, (..., n, n).

    Boxes (..., n, 4) as for `side_by_side`.
    """
    x1, y1, x2, y2 = _columns(boxes_px)
    wide, high = x2 - x1, y2 - y1
    across = np.minimum(_rows(x2), x2) - np.maximum(_rows(x1), x1)
    down = np.minimum(_rows(y2), y2) - np.maximum(_rows(y1), y1)
    within = np.maximum(across, 0) * np.maximum(down, 0) >= _WITHIN_SHARE * _rows(wide * high)
    waterline = _GAP_PX + _WATERLINE_SHARE * np.maximum(high, wide)
    return np.asarray(
        within & (_rows(wide) <= _PART_SHARE * wide) & (np.abs(_rows(y2) - y2) <= waterline)
    )
