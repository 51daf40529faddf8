"""Which of the truth a detector is expected to find: one rule for training and for judging.

A target is a whole vessel (a convoy counts once, not hull by hull), of which at least 30 % of the
silhouette can be seen in the image, and whose box is at least 1/64 of the image's width on its
longer side and 1/160 on its shorter: 10 and 4 pixels of the network's input. Under way or moored
makes no difference. Every other vessel that shows at all is *ignored*: finding it is neither
rewarded nor punished, in the loss as in the figures (a crowd region of COCO).
"""

from collections.abc import Iterable

import numpy as np

from app.domain.arrays import Float32Array
from app.simulation.truth import VesselClass, VesselTruth

LEAST_VISIBLE_SHARE = 0.3
LEAST_LONGER_SIDE = 1 / 64  # of the image's width
LEAST_SHORTER_SIDE = 1 / 160  # of the image's width


def boxes_of(truths: Iterable[VesselTruth], width_px: int) -> Float32Array:
    """Return (n, 5): x1 y1 x2 y2 px of what shows of each vessel, and 1 for a target, 0 to ignore.

    Args:
        truths: every vessel of an image.
        width_px: the image's width.

    """
    rows = []
    for truth in truths:
        if truth.box_px is None or truth.class_name is VesselClass.SUBVESSEL:
            continue
        x1, y1, x2, y2 = truth.box_px
        shorter, longer = sorted((x2 - x1, y2 - y1))
        counts = (
            truth.visible_fraction >= LEAST_VISIBLE_SHARE
            and longer >= LEAST_LONGER_SIDE * width_px
            and shorter >= LEAST_SHORTER_SIDE * width_px
        )
        rows.append((x1, y1, x2, y2, float(counts)))
    return np.array(rows, dtype=np.float32).reshape(-1, 5)
