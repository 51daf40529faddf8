"""From all that a network says to the vessels that count: the same choice for every family."""

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.class_numbers import Labels
from app.domain.detection import Detection, DetectionSettings
from app.domain.suppression import suppress


def vessels_of(
    boxes: FloatArray,
    scores: FloatArray,
    class_ids: Labels,
    settings: DetectionSettings,
    image_px: tuple[int, int],
    *,
    suppressing: bool = False,
) -> list[Detection]:
    """Return the vessels among boxes in full-image px, by falling score, cut at the image.

    Args:
        boxes: (n, 4) x1 y1 x2 y2.
        scores: (n,), 0 to 1.
        class_ids: (n,).
        settings: thresholds and the classes that count.
        image_px: width and height.
        suppressing: whether boxes that show the same vessel are still among them.

    """
    wanted = (
        (scores >= settings.score_threshold)
        & np.isin(class_ids, settings.class_ids)
        & np.isfinite(boxes).all(axis=1)
    )
    boxes, scores, class_ids = boxes[wanted], scores[wanted], class_ids[wanted]
    if suppressing:
        order = suppress(boxes, scores, settings.nms_iou)
    else:
        order = np.argsort(-scores, kind="stable")
    clipped = np.clip(boxes[order], 0.0, image_px * 2).tolist()
    return [
        Detection(x1, y1, x2, y2, float(scores[index]), int(class_ids[index]))
        for (x1, y1, x2, y2), index in zip(clipped, order, strict=True)
        if x2 > x1 and y2 > y1
    ]
