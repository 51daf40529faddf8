"""What the exports of all families but YOLOX share: place the image, run, read, choose.

A family says where the photograph goes, which inputs there are beside it, and how the outputs
become boxes; the rest is the same for all.
"""

import ast
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.class_numbers import ClassNumbers, numbers_of
from app.domain.detection import Detection, DetectionSettings
from app.domain.placement import Colours, Placement
from app.domain.reduced_decoding import divisor_for
from app.domain.selection import vessels_of
from worker.inference.session import ModelRefusedError, OnnxSession
from worker.inference.tensors import ImageInput

Arrays = Sequence[npt.NDArray[np.generic]]
LONGEST_METADATA = 100_000


class Answers(NamedTuple):
    """Boxes (n, 4) x1 y1 x2 y2 in full-image px, scores (n,) and the network's labels (n,)."""

    boxes: FloatArray
    scores: FloatArray
    labels: npt.NDArray[np.generic]


class ExportedDetector(ABC):
    """A model whose graph has its own inputs and outputs, ready to look at photographs."""

    form: str
    """What the outputs mean, for people."""
    suppressing: bool = False
    """Whether boxes of the same vessel are still among the answers."""

    def __init__(
        self,
        session: OnnxSession,
        settings: DetectionSettings,
        family: str,
        image: ImageInput,
        colours: Colours,
        classes: ClassNumbers,
        output_names: Sequence[str],
    ) -> None:
        self.session = session
        self.settings = settings
        self.image = image
        self.classes = classes
        self._family = family
        self._colours = colours
        self._output_names = output_names
        unknown = classes.unknown(settings.class_ids)
        if unknown is not None:
            raise ModelRefusedError(
                f"the model tells {classes.count} classes apart, so class {unknown} does not "
                "exist in it: choose class_ids below that"
            )

    @property
    def settings_sha256(self) -> str:
        """Return the key of the detection settings."""
        return self.settings.sha256

    @property
    def signature(self) -> dict[str, object]:
        """Return what the model takes and gives, as JSON."""
        return {
            "family": self._family,
            "form": self.form,
            "input": "; ".join(str(tensor) for tensor in self.session.inputs),
            "output": "; ".join(str(tensor) for tensor in self.session.outputs),
            "width_px": self.image.width_px,
            "height_px": self.image.height_px,
            "class_count": self.classes.count,
            "class_names": self.classes.names,
            "coco_ids": self.classes.are_coco_ids,
        }

    def decoding_divisor(self, image_px: tuple[int, int]) -> int:
        """Return how much smaller an image (width, height) may be decoded."""
        placement = self._place(image_px)
        needed_px = placement.scaled_width_px, placement.scaled_height_px
        return divisor_for(image_px, needed_px, self.settings.decoding_divisor)

    def detect(
        self, image_bgr: UInt8Array, image_px: tuple[int, int] | None = None
    ) -> list[Detection]:
        """Return the vessels in an image (height, width, 3), BGR, by falling score."""
        size = image_px or (image_bgr.shape[1], image_bgr.shape[0])
        placement = self._place(size)
        feeds = {self.image.name: self.image.feed(placement.tensor(image_bgr, self._colours))}
        outputs = self.session.answers(
            self._output_names, {**feeds, **self._other_inputs(placement)}
        )
        try:
            answers = self._read(outputs, placement)
        except (ValueError, IndexError) as error:
            shapes = ", ".join(str(list(output.shape)) for output in outputs)
            raise ModelRefusedError(
                f"the model's outputs have shapes {shapes}, not those it declared: {error}"
            ) from error
        return vessels_of(
            answers.boxes,
            answers.scores,
            self.classes.class_ids(answers.labels),
            self.settings,
            size,
            suppressing=self.suppressing,
        )

    @abstractmethod
    def _place(self, image_px: tuple[int, int]) -> Placement:
        """Return where an image (width, height) goes in the input."""

    def _other_inputs(self, placement: Placement) -> Mapping[str, npt.NDArray[np.generic]]:  # noqa: ARG002  families have them
        """Return what the model takes beside the photograph."""
        return {}

    @abstractmethod
    def _read(self, outputs: Arrays, placement: Placement) -> Answers:
        """Return the answers in outputs. Raises ValueError for shapes that do not fit."""


def classes_of(
    session: OnnxSession, count: int | None, *, ids_by_default: bool = False
) -> ClassNumbers:
    """Return what labels mean, by metadata or number. Raises ModelRefusedError."""
    names = class_names_of(session.metadata)
    if names is not None and count is not None and len(names) != count:
        raise ModelRefusedError(
            f"the metadata names {len(names)} classes: it must be a list of {count} names"
        )
    try:
        return numbers_of(count, names, ids_by_default=ids_by_default)
    except ValueError as error:
        raise ModelRefusedError(str(error)) from error


def class_names_of(metadata: Mapping[str, str]) -> tuple[str, ...] | None:
    """Return the names in `class_names` (a JSON list), or in Ultralytics' `names`.

    Raises ModelRefusedError.
    """
    text = metadata.get("class_names")
    if text is not None:
        try:
            names = json.loads(text)
        except (ValueError, RecursionError):
            names = None
        if not isinstance(names, list):
            raise ModelRefusedError("the metadata entry 'class_names' must be a JSON list of names")
        return tuple(str(name) for name in names)
    return _ultralytics_names(metadata.get("names", ""))


def _ultralytics_names(text: str) -> tuple[str, ...] | None:
    """Read `{0: 'person', 1: 'bicycle'}`; anything else names nothing."""
    if not text or len(text) > LONGEST_METADATA:
        return None
    try:
        names = ast.literal_eval(text)
    except (ValueError, SyntaxError, RecursionError, MemoryError):
        return None
    if isinstance(names, dict) and list(names) == list(range(len(names))):
        return tuple(str(name) for name in names.values())
    return None
