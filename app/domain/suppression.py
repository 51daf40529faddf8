"""Non-maximum suppression: of boxes that show the same vessel, the best-scored one stays.

Greedy, in the order of falling score; a box falls if its overlap with a better one that stayed is
larger than the limit. Source: as in YOLOX; the same boxes stay as with OpenCV's `NMSBoxes`.
"""

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray


def suppress(boxes: FloatArray, scores: FloatArray, iou_limit: float) -> npt.NDArray[np.intp]:
    """Return the indices of the boxes (n, 4) x1 y1 x2 y2 that stay, by falling score (n,)."""
    order = np.argsort(-scores, kind="stable")
    areas = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    stay: list[np.intp] = []
    while order.size:
        best, others = order[0], order[1:]
        stay.append(best)
        corner_1 = np.maximum(boxes[best, :2], boxes[others, :2])
        corner_2 = np.minimum(boxes[best, 2:], boxes[others, 2:])
        overlap = np.prod(np.maximum(corner_2 - corner_1, 0.0), axis=1)
        union = areas[best] + areas[others] - overlap
        # Compared without division: two boxes of no area have no overlap, not NaN.
        order = others[overlap <= iou_limit * union]
    return np.array(stay, dtype=np.intp)
