"""Models whose graph ends with the chosen boxes: Cascade R-CNN, and others exported in this way.

Two forms are common. mmdetection gives `dets` [1, n, 5] (corners in input pixels, and the score)
and `labels` [1, n], counted from 0. torchvision gives `boxes` [n, 4], `labels` [n] (COCO's
published ids) and `scores` [n]; its graph takes RGB from 0 to 1 and scales the image itself.

mmdetection exports all its detectors in the same form, and only the family tells how an image is
prepared for it, so it must be named for any other than Cascade R-CNN. Rows beside the chosen ones
may be padding with score 0 or label -1, and masks may be a further output; they are left alone.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.detection import DetectionSettings
from app.domain.placement import (
    BGR_BYTES,
    RGB_IMAGENET,
    RGB_SHARES,
    Colours,
    Placement,
    in_corner,
    with_short_side,
)
from worker.inference.families.exported import Answers, Arrays, ExportedDetector, classes_of
from worker.inference.session import OnnxSession, TensorSignature
from worker.inference.tensors import FLOATS, INTEGERS, ImageInput, image_input_of, may_be, refuse

CASCADE = "cascade-rcnn"
EXPECTED = (
    "an image [1, 3, height, width] (or [3, height, width]); dets [1, n, 5] and labels [1, n], "
    "or boxes [n, 4], labels [n] and scores [n]"
)


class Preparation(NamedTuple):
    """How mmdetection prepares an image for a family: short and longest side, px, and padding."""

    colours: Colours
    short_px: int
    longest_px: int
    multiple_px: int


PREPARATIONS = {
    CASCADE: Preparation(RGB_IMAGENET, 800, 1333, 32),
    "detr": Preparation(RGB_IMAGENET, 800, 1333, 1),
    "deformable-detr": Preparation(RGB_IMAGENET, 800, 1333, 1),
    "deformable-detr-two-stage": Preparation(RGB_IMAGENET, 800, 1333, 1),
    "yolov3": Preparation(RGB_SHARES, 608, 608, 32),
    "yolox": Preparation(BGR_BYTES, 640, 640, 32),
}


@dataclass(frozen=True, slots=True)
class ChosenSignature:
    """The tensors: the boxes (with their scores if `scores` is None), labels and scores."""

    image: ImageInput
    boxes: TensorSignature
    labels: TensorSignature
    scores: TensorSignature | None


def signature_of(session: OnnxSession) -> ChosenSignature | None:
    """Return the tensors of an end-to-end export; None when the model has others."""
    image = image_input_of(session)
    if image is None or len(session.inputs) != 1:
        return None
    boxes = _one(session.outputs, 4)
    dets = _one(session.outputs, 5)
    flat = [t for t in session.outputs if may_be(t, None) or may_be(t, 1, None)]
    if len(session.outputs) in {2, 3} and dets is not None:
        labels = next((t for t in flat if t.element_type in INTEGERS | FLOATS), None)
        if labels is not None:
            return ChosenSignature(image, dets, labels, None)
    if len(session.outputs) in {3, 4} and boxes is not None:
        labels = next((t for t in flat if t.element_type in INTEGERS), None)
        scores = next((t for t in flat if t.element_type in FLOATS and t is not boxes), None)
        if labels is not None and scores is not None:
            return ChosenSignature(image, boxes, labels, scores)
    return None


class EndToEndDetector(ExportedDetector):
    """A model that gives chosen boxes.

    Raises ModelRefusedError when its signature or classes do not fit.
    """

    form = "chosen boxes in input pixels"

    def __init__(self, session: OnnxSession, settings: DetectionSettings, family: str) -> None:
        signature = signature_of(session)
        if signature is None:
            raise refuse(session, family, EXPECTED)
        self._has_scores = signature.scores is not None
        self._preparation = PREPARATIONS[family]
        outputs = [signature.boxes.name, signature.labels.name]
        if signature.scores is not None:
            outputs.append(signature.scores.name)
        super().__init__(
            session,
            settings,
            family,
            signature.image,
            RGB_SHARES if self._has_scores else self._preparation.colours,
            classes_of(session, None, ids_by_default=self._has_scores),
            outputs,
        )

    def _place(self, image_px: tuple[int, int]) -> Placement:
        size = self.image.fixed_px()
        if size is not None:
            return in_corner(image_px, size)
        if self._has_scores:
            return Placement(*image_px, *image_px, *image_px)
        _, short_px, longest_px, multiple_px = self._preparation
        return with_short_side(image_px, short_px, longest_px, multiple_px)

    def _read(self, outputs: Arrays, placement: Placement) -> Answers:
        values = np.asarray(outputs[0], dtype=np.float64)
        columns = 4 if self._has_scores else 5
        if values.ndim not in {2, 3} or values.shape[-1] != columns:
            raise ValueError(f"wanted are rows of {columns} numbers")
        values = values.reshape(-1, columns)
        boxes: FloatArray = values[:, :4]
        scores = (
            np.asarray(outputs[2], dtype=np.float64).ravel() if self._has_scores else values[:, 4]
        )
        labels = outputs[1].ravel()
        if not len(boxes) == len(scores) == len(labels):
            raise ValueError("wanted are as many labels and scores as boxes")
        return Answers(placement.to_image_px(boxes), scores, labels)


def _one(tensors: tuple[TensorSignature, ...], columns: int) -> TensorSignature | None:
    """Return the float tensor that has rows of so many numbers: [n, columns] or [1, n, columns]."""
    found = [
        t
        for t in tensors
        if t.element_type in FLOATS
        and (may_be(t, None, columns) or may_be(t, 1, None, columns))
        and t.shape[-1] == columns
    ]
    return found[0] if len(found) == 1 else None
