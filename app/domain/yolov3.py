"""What YOLOv3 says, made into boxes: three grids, three anchors a cell.

For each anchor of a cell the network gives the centre's offset and the logarithmic size relative
to the anchor, the logit that something is there, and one for each class. Some exports contain
this decoding already and give centres and sizes in input pixels, others even choose the boxes.
Answers are in input pixels.

Sources: Redmon and Farhadi 2018; the anchors of darknet's `yolov3.cfg`.
"""

import numpy as np

from app.domain.answers import Answers
from app.domain.arrays import Float32Array, FloatArray

ANCHORS_PX = {
    8: ((10.0, 13.0), (16.0, 30.0), (33.0, 23.0)),
    16: ((30.0, 61.0), (62.0, 45.0), (59.0, 119.0)),
    32: ((116.0, 90.0), (156.0, 198.0), (373.0, 326.0)),
}
ANCHORS_PER_CELL = 3
_LARGEST_LOG = 20.0


def cell_anchor_count(width_px: int, height_px: int) -> int:
    """Return how many boxes a network of this input size gives."""
    return sum(ANCHORS_PER_CELL * (width_px // s) * (height_px // s) for s in ANCHORS_PX)


def columns_of_head(head: Float32Array, stride_px: int, input_px: tuple[int, int]) -> Float32Array:
    """Return a head as (rows, columns, 3, 5 + classes), whatever order it was exported in.

    Args:
        head: [3 (5 + classes), rows, columns], [rows, columns, 3 (5 + classes)],
            [3, rows, columns, 5 + classes] or [rows, columns, 3, 5 + classes].
        stride_px: input pixels a cell.
        input_px: width and height of the input.

    Raises ValueError when the shape is none of these.

    """
    columns, rows = input_px[0] // stride_px, input_px[1] // stride_px
    shape = head.shape
    if head.ndim == 3 and shape[1:] == (rows, columns) and shape[0] % ANCHORS_PER_CELL == 0:
        return head.reshape(ANCHORS_PER_CELL, -1, rows, columns).transpose(2, 3, 0, 1)
    if head.ndim == 3 and shape[:2] == (rows, columns) and shape[2] % ANCHORS_PER_CELL == 0:
        return head.reshape(rows, columns, ANCHORS_PER_CELL, -1)
    if head.ndim == 4 and shape[:3] == (ANCHORS_PER_CELL, rows, columns):
        return head.transpose(1, 2, 0, 3)
    if head.ndim == 4 and shape[:3] == (rows, columns, ANCHORS_PER_CELL):
        return head
    raise ValueError(f"a head of shape {list(shape)} has no {rows} x {columns} cells of 3 anchors")


def answers_of_head(
    cells: Float32Array, stride_px: int, score_threshold: float, labels: tuple[int, ...]
) -> Answers:
    """Read a head (rows, columns, 3, 5 + classes): each wanted label of an anchor on its own."""
    chances = _sigmoid(cells[..., 4])
    places = np.argwhere(chances >= score_threshold)  # no class makes a score larger
    values = cells[tuple(places.T)].astype(np.float64)
    anchors = np.array(ANCHORS_PX[stride_px])[places[:, 2]]
    centre = (_sigmoid(values[:, :2]) + places[:, 1::-1]) * stride_px
    half = np.exp(np.minimum(values[:, 2:4], _LARGEST_LOG)) * anchors / 2
    boxes = np.concatenate([centre - half, centre + half], axis=1)
    known = [label for label in labels if 5 + label < cells.shape[-1]]
    scores = _sigmoid(values[:, [5 + label for label in known]])
    scores *= _sigmoid(values[:, 4:5])
    return Answers(
        np.repeat(boxes, len(known), axis=0),
        scores.ravel(),
        np.tile(np.array(known, dtype=np.int64), len(boxes)),
    )


def answers_of_rows(rows: Float32Array) -> Answers:
    """Read rows (n, 5 + classes) that the graph decoded: centre and size in input px, shares."""
    values = rows.astype(np.float64)
    half = values[:, 2:4] / 2
    boxes = np.concatenate([values[:, :2] - half, values[:, :2] + half], axis=1)
    labels = values[:, 5:].argmax(axis=1)
    return Answers(boxes, values[:, 4] * values[np.arange(len(rows)), 5 + labels], labels)


def _sigmoid(values: Float32Array | FloatArray) -> FloatArray:
    return 0.5 * (1.0 + np.tanh(values.astype(np.float64) / 2))
