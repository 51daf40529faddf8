"""YOLOv3 in the three forms in which it is exported.

Heads: three outputs, one for each grid, as darknet has them, in any of the usual orders. Rows: one
output [1, boxes, 5 + classes] that the graph decoded, as Ultralytics exports it (its heads may
stand beside it). Chosen: boxes, scores and indices, of the ONNX model zoo, which also takes
`image_shape` and answers in the photograph's own pixels. A fourth, mmdetection's, is end to end.

Input: RGB from 0 to 1, scaled until it fits and put into the middle of grey.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain import yolov3
from app.domain.detection import DetectionSettings
from app.domain.placement import RGB_SHARES_ON_GREY, Placement, in_middle
from worker.inference.families.exported import Answers, Arrays, ExportedDetector, classes_of
from worker.inference.session import OnnxSession, TensorSignature
from worker.inference.tensors import (
    FLOATS,
    INTEGERS,
    ImageInput,
    fixed,
    image_input_of,
    is_one,
    may_be,
    refuse,
)

YOLOV3 = "yolov3"
EXPECTED = (
    "an image [1, 3, height, width] with sides that are multiples of 32; three heads of 3 "
    "(5 + classes) channels, or decoded rows [1, boxes, 5 + classes], or with image_shape [1, 2] "
    "also boxes [1, n, 4], scores [1, classes, n] and indices [k, 3]"
)
_BOX_AND_CHANCE = 5
# Where an export leaves the size free: that of the zoo and of darknet, or of Ultralytics.
_FREE_SIDE_PX = {"chosen": 416, "heads": 416, "rows": 640}
_COARSEST_PX = 32


@dataclass(frozen=True, slots=True)
class GridSignature:
    """The tensors of a YOLOv3: its outputs in the order they are read, and its classes if known."""

    form: str
    image: ImageInput
    outputs: tuple[str, ...]
    classes: int | None
    image_shape: TensorSignature | None = None


def signature_of(session: OnnxSession) -> GridSignature | None:
    """Return the tensors of a YOLOv3; None when the model has others."""
    image = image_input_of(session)
    if image is None or image.rank != 4:
        return None
    if any(side is not None and side % _COARSEST_PX for side in (image.width_px, image.height_px)):
        return None
    forms = (_chosen, _rows, _heads)
    return next((found for form in forms if (found := form(session, image))), None)


class Yolov3Detector(ExportedDetector):
    """A YOLOv3 model.

    Raises ModelRefusedError when its signature or classes do not fit.
    """

    def __init__(self, session: OnnxSession, settings: DetectionSettings, family: str) -> None:
        signature = signature_of(session)
        if signature is None:
            raise refuse(session, family, EXPECTED)
        super().__init__(
            session,
            settings,
            family,
            signature.image,
            RGB_SHARES_ON_GREY,
            classes_of(session, signature.classes),
            signature.outputs,
        )
        self.form = signature.form
        self.suppressing = signature.image_shape is None
        self._image_shape = signature.image_shape
        readers: dict[str, Callable[[Arrays, Placement], Answers]] = {
            "heads": self._read_heads,
            "rows": _read_rows,
            "chosen": _read_chosen,
        }
        self._reader = readers[signature.form]

    def _place(self, image_px: tuple[int, int]) -> Placement:
        side_px = _FREE_SIDE_PX[self.form]
        width_px = self.image.width_px or self.image.height_px or side_px
        height_px = self.image.height_px or self.image.width_px or side_px
        return in_middle(image_px, (width_px, height_px))

    def _other_inputs(self, placement: Placement) -> Mapping[str, npt.NDArray[np.generic]]:
        if self._image_shape is None:
            return {}
        shape = [[placement.image_height_px, placement.image_width_px]]
        dtype = (FLOATS | INTEGERS)[self._image_shape.element_type]
        return {self._image_shape.name: np.array(shape, dtype=dtype)}

    def _read(self, outputs: Arrays, placement: Placement) -> Answers:
        return self._reader(outputs, placement)

    def _read_heads(self, outputs: Arrays, placement: Placement) -> Answers:
        size = (placement.input_width_px, placement.input_height_px)
        heads = sorted((np.asarray(output[0], np.float32) for output in outputs), key=np.size)
        answers = []
        for stride_px, head in zip(sorted(yolov3.ANCHORS_PX, reverse=True), heads, strict=True):
            cells = yolov3.columns_of_head(head, stride_px, size)
            answers.append(
                yolov3.answers_of_head(
                    cells, stride_px, self.settings.score_threshold, self.settings.class_ids
                )
            )
        boxes, scores, labels = (np.concatenate(parts) for parts in zip(*answers, strict=True))
        return Answers(placement.to_image_px(boxes), scores, labels)


def _read_rows(outputs: Arrays, placement: Placement) -> Answers:
    rows = np.asarray(outputs[0][0], dtype=np.float32)
    if rows.ndim != 2 or rows.shape[1] <= _BOX_AND_CHANCE:
        raise ValueError("wanted are rows of 5 + classes numbers")
    cells = yolov3.cell_anchor_count(placement.input_width_px, placement.input_height_px)
    if len(rows) != cells:
        raise ValueError(f"wanted are {cells} rows, three for each cell")
    boxes, scores, labels = yolov3.answers_of_rows(rows)
    return Answers(placement.to_image_px(boxes), scores, labels)


def _read_chosen(outputs: Arrays, _placement: Placement) -> Answers:
    boxes, scores = (np.asarray(output[0], dtype=np.float64) for output in outputs[:2])
    indices = outputs[2].reshape(-1, 3).astype(np.int64)
    indices = indices[(indices >= 0).all(axis=1)]  # padding is -1
    labels, places = indices[:, 1], indices[:, 2]
    top_left_first = boxes[places][:, [1, 0, 3, 2]]
    return Answers(top_left_first, scores[labels, places], labels)


def _chosen(session: OnnxSession, image: ImageInput) -> GridSignature | None:
    shapes = [t for t in session.inputs if t.name != image.name]
    if len(session.inputs) != 2 or not may_be(shapes[0], 1, 2):
        return None
    if shapes[0].element_type not in FLOATS | INTEGERS or len(session.outputs) != 3:
        return None
    indices = [t for t in session.outputs if t.element_type in INTEGERS]
    boxes = [t for t in session.outputs if t.element_type in FLOATS and may_be(t, 1, None, 4)]
    boxes = [t for t in boxes if fixed(t.shape[2]) == 4] or boxes
    scores = [t for t in session.outputs if t.element_type in FLOATS and t not in boxes[:1]]
    if len(indices) != 1 or not boxes or len(scores) != 1 or len(scores[0].shape) != 3:
        return None
    names = (boxes[0].name, scores[0].name, indices[0].name)
    return GridSignature("chosen", image, names, fixed(scores[0].shape[1]), shapes[0])


def _rows(session: OnnxSession, image: ImageInput) -> GridSignature | None:
    """Look for decoded rows; heads of rank 5 may stand beside them."""
    rows = [t for t in session.outputs if t.element_type in FLOATS and may_be(t, 1, None, None)]
    if len(session.inputs) != 1 or len(rows) != 1:
        return None
    if any(len(t.shape) != 5 for t in session.outputs if t is not rows[0]):
        return None
    count, columns, size = fixed(rows[0].shape[1]), fixed(rows[0].shape[2]), image.fixed_px()
    if columns is None or columns <= _BOX_AND_CHANCE:
        return None
    if size is not None and count not in {None, yolov3.cell_anchor_count(*size)}:
        return None
    return GridSignature("rows", image, (rows[0].name,), columns - _BOX_AND_CHANCE)


def _heads(session: OnnxSession, image: ImageInput) -> GridSignature | None:
    outputs = session.outputs
    if len(session.inputs) != 1 or len(outputs) != 3:
        return None
    ranks = {len(t.shape) for t in outputs}
    floats = all(t.element_type in FLOATS and is_one(t.shape[0]) for t in outputs if t.shape)
    if not floats or ranks not in ({4}, {5}):
        return None
    classes = {_classes_of_head(tensor, image) for tensor in outputs}
    if len(classes - {None}) > 1 or 0 in classes:
        return None
    known = max((count for count in classes if count is not None), default=None)
    return GridSignature("heads", image, tuple(t.name for t in outputs), known)


def _classes_of_head(tensor: TensorSignature, image: ImageInput) -> int | None:
    """Return how many classes a head tells apart; None if its shape is free, 0 if it is none."""
    if len(tensor.shape) == 5:
        columns = fixed(tensor.shape[4])
        return None if columns is None else max(columns - _BOX_AND_CHANCE, 0)
    size = image.fixed_px()
    sides = set() if size is None else {side // s for side in size for s in yolov3.ANCHORS_PX}
    first, last = fixed(tensor.shape[1]), fixed(tensor.shape[3])
    channels = last if first is None or (first in sides and last not in sides) else first
    if channels is None:
        return None
    per_anchor, rest = divmod(channels, yolov3.ANCHORS_PER_CELL)
    return 0 if rest else max(per_anchor - _BOX_AND_CHANCE, 0)
