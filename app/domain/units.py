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


def _columns(detections: Sequence[Detection]) -> FloatArray:
    return np.array([(d.x1_px, d.y1_px, d.x2_px, d.y2_px) for d in detections])


def rows_of_hulls(
    detections: Sequence[Detection],
) -> Iterator[tuple[Detection, tuple[int, ...]]]:
    """Yield boxes around two or more detections of an image that may be one unit, and which."""
    if len(detections) < 2:
        return
    after = _side_by_side(_columns(detections))
    for first in np.flatnonzero(after.any(axis=1)):
        row = [int(first)]
        while len(row) < MOST_HULLS and after[row[-1]].any():
            row.append(int(np.argmax(after[row[-1]])))
            yield _around([detections[i] for i in row]), tuple(row)


def _side_by_side(boxes_px: FloatArray) -> BoolArray:
    """Return which box (rows) has which other (columns) as the next hull on its right."""
    x1, y1, x2, y2 = boxes_px.T
    wide, high = x2 - x1, y2 - y1
    gap = x1[None] - x2[:, None]
    low = np.minimum(high[:, None], high[None])
    short = np.minimum(wide[:, None], wide[None])
    rise = np.abs(y2[:, None] - y2[None])
    return np.asarray(
        (x1[:, None] < x1[None])
        & (gap <= _GAP_PX + _GAP_SHARE * low)
        & (gap >= -_GAP_PX - _OVERLAP_SHARE * short)
        & (rise <= _RISE_PX + _RISE_SHARE * (wide[:, None] + wide[None]))
    )


def _around(hulls: Sequence[Detection]) -> Detection:
    return Detection(
        min(hull.x1_px for hull in hulls),
        min(hull.y1_px for hull in hulls),
        max(hull.x2_px for hull in hulls),
        max(hull.y2_px for hull in hulls),
        max(hull.score for hull in hulls),
        hulls[0].class_id,
    )


def parts_of(detections: Sequence[Detection]) -> BoolArray:
    """Return which detection (rows) may be a part of which other (columns) of an image, (n, n)."""
    boxes = _columns(detections).reshape(-1, 4)
    x1, y1, x2, y2 = boxes.T
    wide, high = x2 - x1, y2 - y1
    across = np.minimum(x2[:, None], x2[None]) - np.maximum(x1[:, None], x1[None])
    down = np.minimum(y2[:, None], y2[None]) - np.maximum(y1[:, None], y1[None])
    within = np.maximum(across, 0) * np.maximum(down, 0) >= _WITHIN_SHARE * (wide * high)[:, None]
    waterline = _GAP_PX + _WATERLINE_SHARE * np.maximum(high, wide)[None]
    return np.asarray(
        within
        & (wide[:, None] <= _PART_SHARE * wide[None])
        & (np.abs(y2[:, None] - y2[None]) <= waterline)
    )
