"""What a YOLOX network says, made into boxes: grids, strides, thresholds.

The network answers for every cell of three grids (8, 16 and 32 input pixels wide): an offset and
a logarithmic size relative to the cell, the probability that something is there, and one for
each class. Almost all cells see nothing, so the score is looked at first and only what remains is
decoded, which is twenty times faster than the other way round.

Some exports contain that step (`decode_in_inference`) and have the same shape: their rows are
centres and sizes in input pixels. No size of theirs is negative, and centres lie near their cells.

Source: YOLOX, `demo_postprocess` and `multiclass_nms` (class-agnostic) of its ONNX demo.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array, FloatArray
from app.domain.detection import Detection, DetectionSettings
from app.domain.letterbox import Letterbox
from app.domain.suppression import suppress

STRIDES = (8, 16, 32)
_BOX_AND_OBJECTNESS = 5
_LARGEST_LOG = 20.0  # a box of half a billion strides: far beyond any image, yet finite


def cell_count(input_width_px: int, input_height_px: int) -> int:
    """Return how many rows the network's output has for an input size."""
    return sum((input_width_px // s) * (input_height_px // s) for s in STRIDES)


def class_count(output_columns: int) -> int:
    """Return how many classes an output of so many columns tells apart; below 1: none."""
    return output_columns - _BOX_AND_OBJECTNESS


def detections_of(
    output: Float32Array, letterbox: Letterbox, settings: DetectionSettings
) -> list[Detection]:
    """Return the vessels in a network's answer, by falling score, in full-image pixels.

    Args:
        output: (cells, 5 + classes): offset x y, log size w h, objectness, class probabilities.
        letterbox: how the image was fitted into the input.
        settings: thresholds and the classes that count.

    """
    # No class probability exceeds 1, so objectness alone already rules most cells out.
    candidates = np.flatnonzero(output[:, 4] >= settings.score_threshold)
    rows = output[candidates]
    classes = rows[:, _BOX_AND_OBJECTNESS:].argmax(axis=1)
    scores = rows[:, 4] * rows[np.arange(len(rows)), _BOX_AND_OBJECTNESS + classes]
    wanted = (
        (scores >= settings.score_threshold)
        & np.isin(classes, settings.class_ids)
        & np.isfinite(rows[:, :4]).all(axis=1)
    )
    size = (letterbox.input_width_px, letterbox.input_height_px)
    numbers = rows[wanted].astype(np.float64)
    if is_decoded(output, *size):
        half_size = numbers[:, 2:4] / 2
        boxes = np.concatenate([numbers[:, :2] - half_size, numbers[:, :2] + half_size], axis=1)
    else:
        boxes = _boxes_in_input_px(numbers, candidates[wanted], *size)
    scores, classes = scores[wanted].astype(np.float64), classes[wanted]
    stay = suppress(boxes, scores, settings.nms_iou)
    return [
        Detection(x1, y1, x2, y2, float(scores[index]), int(classes[index]))
        for (x1, y1, x2, y2), index in zip(
            letterbox.to_image_px(boxes[stay]).tolist(), stay, strict=True
        )
        if x2 > x1 and y2 > y1  # a box within the padding has nothing left
    ]


def is_decoded(output: Float32Array, width_px: int, height_px: int) -> bool:
    """Whether rows (cells, 5 + classes) are centres and sizes in input px, not offsets."""
    if not (output[:, 2:4] > 0).all():  # a raw network has negative logarithms
        return False
    grid = _grid(width_px, height_px)
    stride = grid[:, 2:]
    as_pixels = np.abs(output[:, :2] / stride - grid[:, :2] - 0.5)
    as_offsets = np.abs(output[:, :2] - 0.5)
    return bool(np.median(as_pixels) < np.median(as_offsets))


def _boxes_in_input_px(
    rows: FloatArray,
    cells: npt.NDArray[np.intp],
    width_px: int,
    height_px: int,
) -> FloatArray:
    """Decode rows of the output into boxes (n, 4) x1 y1 x2 y2 in input pixels."""
    grid = _grid(width_px, height_px)[cells]
    stride = grid[:, 2:]
    centre = (rows[:, :2] + grid[:, :2]) * stride
    half_size = np.exp(np.minimum(rows[:, 2:4], _LARGEST_LOG)) * stride / 2
    return np.concatenate([centre - half_size, centre + half_size], axis=1)


@lru_cache(maxsize=8)
def _grid(width_px: int, height_px: int) -> FloatArray:
    """Column, row and stride of every cell, shape (cells, 3), in the order of the output."""
    levels = []
    for stride in STRIDES:
        rows, columns = np.mgrid[: height_px // stride, : width_px // stride]
        strides = np.full(rows.size, stride)
        levels.append(np.stack([columns.ravel(), rows.ravel(), strides], axis=1))
    return np.concatenate(levels).astype(np.float64)
