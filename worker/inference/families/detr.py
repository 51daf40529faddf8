"""The DETR families: a set of queries, each with logits [1, queries, classes] and a box.

DETR and Deformable DETR have the same outputs (`logits` and `pred_boxes`, or `pred_logits`) and
mean other things by them: DETR has one class more, "no object". So the number of classes tells
them apart: 92 and 81 are DETR's, 91 and 80 Deformable DETR's, and with named classes it is one
more than there are names. Two-stage Deformable DETR also gives what its encoder proposed.
Only then is the number of queries asked: DETR was published with 100.

Input: RGB with ImageNet's mean and deviation, short side 800 and long side at most 1333 pixels; an
input of fixed size is filled. `pixel_mask` may be there or not.

Sources: facebookresearch/detr, fundamentalvision/Deformable-DETR, Hugging Face transformers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.class_numbers import COCO_CLASSES, COCO_IDS
from app.domain.detection import DetectionSettings
from app.domain.detr import exclusive_answers, independent_answers
from app.domain.placement import RGB_IMAGENET, Placement, stretched, with_short_side
from worker.inference.families.exported import (
    Answers,
    Arrays,
    ExportedDetector,
    class_names_of,
    classes_of,
)
from worker.inference.session import OnnxSession, TensorSignature
from worker.inference.tensors import (
    FLOATS,
    ImageInput,
    fixed,
    image_input_of,
    is_mask,
    is_one,
    mask_of,
    may_be,
    refuse,
)

DETR, DEFORMABLE, TWO_STAGE = "detr", "deformable-detr", "deformable-detr-two-stage"
EXPECTED = (
    "pixel_values [1, 3, height, width] and maybe pixel_mask [1, height, width]; "
    "logits [1, queries, classes] and pred_boxes [1, queries, 4]"
)
_SHORT_PX, _LONGEST_PX = 800, 1333
_QUERIES_OF_DETR = 100


@dataclass(frozen=True, slots=True)
class QuerySignature:
    """The tensors of a DETR: photograph, mask if any, logits and boxes; two stages or one."""

    image: ImageInput
    mask: TensorSignature | None
    logits: TensorSignature
    boxes: TensorSignature
    has_proposals: bool


def signature_of(session: OnnxSession) -> QuerySignature | None:
    """Return the tensors of a DETR; None when the model has others."""
    image = image_input_of(session)
    others = [t for t in session.inputs if image is not None and t.name != image.name]
    if image is None or image.rank != 4 or len(others) > 1 or not all(map(is_mask, others)):
        return None
    boxes = _named(session.outputs, "pred_boxes", "boxes")
    logits = _named(session.outputs, "logits", "pred_logits", "scores")
    if boxes is None or logits is None:
        boxes, logits = _by_shape(session.outputs)
    if boxes is None or logits is None or not _fit(logits, boxes):
        return None
    proposals = any(tensor.name.startswith("enc_outputs") for tensor in session.outputs)
    return QuerySignature(image, others[0] if others else None, logits, boxes, proposals)


def family_of(signature: QuerySignature, metadata: Mapping[str, str]) -> str:
    """Return which of the families a DETR is (see above)."""
    if signature.has_proposals:
        return TWO_STAGE
    count, queries = fixed(signature.logits.shape[2]), fixed(signature.logits.shape[1])
    names = class_names_of(metadata)
    known = {len(names)} if names is not None else {COCO_CLASSES, COCO_IDS}
    if count in known:
        return DEFORMABLE
    if count is not None and count - 1 in known:
        return DETR
    return DETR if queries == _QUERIES_OF_DETR else DEFORMABLE


class QueryDetector(ExportedDetector):
    """A model of one of the DETR families.

    Raises ModelRefusedError when its signature or classes do not fit.
    """

    def __init__(self, session: OnnxSession, settings: DetectionSettings, family: str) -> None:
        signature = signature_of(session)
        if signature is None:
            raise refuse(session, family, EXPECTED)
        self._mask = signature.mask
        self._is_exclusive = family == DETR
        count = fixed(signature.logits.shape[2])
        if count is not None and self._is_exclusive:
            count -= 1
        super().__init__(
            session,
            settings,
            family,
            signature.image,
            RGB_IMAGENET,
            classes_of(session, count, ids_by_default=True),
            (signature.logits.name, signature.boxes.name),
        )
        self.form = (
            "queries; classes exclude each other and the last is no object"
            if self._is_exclusive
            else "queries; each class on its own, the best 100 answers"
        )

    def _place(self, image_px: tuple[int, int]) -> Placement:
        size = self.image.fixed_px()
        if size is not None:
            return stretched(image_px, size)
        placement = with_short_side(image_px, _SHORT_PX, _LONGEST_PX)
        width_px = self.image.width_px or placement.input_width_px
        height_px = self.image.height_px or placement.input_height_px
        return stretched(image_px, (width_px, height_px))

    def _other_inputs(self, placement: Placement) -> Mapping[str, npt.NDArray[np.generic]]:
        if self._mask is None:
            return {}
        size = (placement.input_width_px, placement.input_height_px)
        return {self._mask.name: mask_of(self._mask, *size)}

    def _read(self, outputs: Arrays, placement: Placement) -> Answers:
        logits, boxes = (np.asarray(output[0], dtype=np.float32) for output in outputs)
        if logits.ndim != 2 or boxes.shape != (len(logits), 4):
            raise ValueError("wanted is a box for each row of logits")
        read = exclusive_answers if self._is_exclusive else independent_answers
        shares, scores, labels = read(logits, boxes)
        size = (placement.image_width_px, placement.image_height_px) * 2
        return Answers(shares * size, scores, labels)


def _named(tensors: tuple[TensorSignature, ...], *names: str) -> TensorSignature | None:
    return next((tensor for name in names for tensor in tensors if tensor.name == name), None)


def _by_shape(
    tensors: tuple[TensorSignature, ...],
) -> tuple[TensorSignature | None, TensorSignature | None]:
    """Tell boxes from logits by their last dimension, when there are just two outputs."""
    if len(tensors) != 2:
        return None, None
    boxes, logits = sorted(tensors, key=lambda t: fixed(t.shape[-1]) != 4 if t.shape else True)
    return boxes, logits


def _fit(logits: TensorSignature, boxes: TensorSignature) -> bool:
    queries = fixed(boxes.shape[1]) if len(boxes.shape) == 3 else None
    return (
        logits.element_type in FLOATS
        and boxes.element_type in FLOATS
        and may_be(boxes, 1, None, 4)
        and may_be(logits, 1, queries, None)
        and is_one(logits.shape[0])
        and (fixed(logits.shape[2]) or 2) >= 2
    )
