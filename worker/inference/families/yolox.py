"""The YOLOX family: models as the YOLOX project exports them, `decode_in_inference` off or on.

Such a model takes one letterboxed image, float32 [1, 3, height, width], and gives one row for
every cell of three grids, [1, cells, 5 + classes]. Many other exports look alike and mean other
numbers, so all of this is checked before the first photograph; whether the graph decodes its rows
only the rows themselves can tell. A model that names its classes in its metadata (`class_names`, a
JSON list) may have any number of them; one that does not is taken to have COCO's.
"""

from dataclasses import dataclass

from app.domain.arrays import UInt8Array
from app.domain.detection import COCO_BOAT, Detection, DetectionSettings
from app.domain.letterbox import Letterbox
from app.domain.reduced_decoding import divisor_for
from app.domain.yolox import STRIDES, cell_count, class_count, detections_of
from worker.inference.families.exported import class_names_of
from worker.inference.session import ModelRefusedError, OnnxSession, TensorSignature
from worker.inference.tensors import is_one, listed

YOLOX = "yolox"
_EXPECTED_INPUT = "one float32 input [1, 3, height, width] with sides that are multiples of 32"
EXPECTED = f"{_EXPECTED_INPUT}; one output [1, cells, 5 + classes]"


@dataclass(frozen=True, slots=True)
class YoloxSignature:
    """Input size in pixels, and classes: their number, and their names if the model has them."""

    width_px: int
    height_px: int
    class_count: int
    class_names: tuple[str, ...] | None


class YoloxDetector:
    """A YOLOX model ready to look at photographs.

    Raises ModelRefusedError when the model's signature or classes do not fit.
    """

    def __init__(self, session: OnnxSession, settings: DetectionSettings) -> None:
        self._session = session
        self._settings = settings
        self._model = _signature_of(session)
        unknown = [index for index in settings.class_ids if index >= self._model.class_count]
        if unknown:
            message = (
                f"the model tells {self._model.class_count} classes apart, so class "
                f"{unknown[0]} does not exist in it: choose class_ids below that"
            )
            raise ModelRefusedError(message)

    @property
    def settings_sha256(self) -> str:
        """Return the key of the detection settings."""
        return self._settings.sha256

    @property
    def signature(self) -> dict[str, object]:
        """Return what the model takes and gives, as JSON."""
        return {
            "family": YOLOX,
            "input": str(self._session.inputs[0]),
            "output": str(self._session.outputs[0]),
            "width_px": self._model.width_px,
            "height_px": self._model.height_px,
            "class_count": self._model.class_count,
            "class_names": self._model.class_names,
        }

    def decoding_divisor(self, image_px: tuple[int, int]) -> int:
        """Return how much smaller an image (width, height) may be decoded."""
        return divisor_for(
            image_px, self._letterbox(image_px).scaled_px, self._settings.decoding_divisor
        )

    def detect(
        self, image_bgr: UInt8Array, image_px: tuple[int, int] | None = None
    ) -> list[Detection]:
        """Return the vessels in an image (height, width, 3), BGR, by falling score."""
        letterbox = self._letterbox(image_px or (image_bgr.shape[1], image_bgr.shape[0]))
        output = self._session.run(letterbox.tensor(image_bgr))
        expected = (1, cell_count(self._model.width_px, self._model.height_px))
        if output.shape[:2] != expected or class_count(output.shape[-1]) != self._model.class_count:
            message = f"the model's output has shape {list(output.shape)}, not the one it declared"
            raise ModelRefusedError(message)
        return detections_of(output[0], letterbox, self._settings)

    def _letterbox(self, image_px: tuple[int, int]) -> Letterbox:
        return Letterbox(*image_px, self._model.width_px, self._model.height_px)


def fits(session: OnnxSession) -> bool:
    """Whether a model has the inputs and outputs of a YOLOX."""
    try:
        _class_count(session.outputs, *_input_size(session.inputs))
    except ModelRefusedError:
        return False
    return True


def _signature_of(session: OnnxSession) -> YoloxSignature:
    width_px, height_px = _input_size(session.inputs)
    classes = _class_count(session.outputs, width_px, height_px)
    names = _class_names(session.metadata, classes)
    if names is None and classes <= COCO_BOAT:
        message = (
            f"the model tells {classes} classes apart and does not name them: expected are COCO's "
            f"80 (class {COCO_BOAT} is boat), or a list 'class_names' in the model's metadata"
        )
        raise ModelRefusedError(message)
    return YoloxSignature(width_px, height_px, classes, names)


def _input_size(inputs: tuple[TensorSignature, ...]) -> tuple[int, int]:
    """Return width and height, px."""
    if len(inputs) == 1 and inputs[0].element_type == "tensor(float)" and len(inputs[0].shape) == 4:
        batch, channels, height_px, width_px = inputs[0].shape
        if (
            is_one(batch)
            and channels == 3
            and isinstance(height_px, int)
            and isinstance(width_px, int)
            and min(height_px, width_px) > 0
            and height_px % STRIDES[-1] == width_px % STRIDES[-1] == 0
        ):
            return width_px, height_px
    message = f"the model has {listed(inputs, 'input')}: expected is {_EXPECTED_INPUT}"
    raise ModelRefusedError(message)


def _class_count(outputs: tuple[TensorSignature, ...], width_px: int, height_px: int) -> int:
    cells = cell_count(width_px, height_px)
    if (
        len(outputs) == 1
        and outputs[0].element_type == "tensor(float)"
        and len(outputs[0].shape) == 3
        and is_one(outputs[0].shape[0])
        and outputs[0].shape[1] == cells
        and isinstance(outputs[0].shape[2], int)
        and class_count(outputs[0].shape[2]) >= 1
    ):
        return class_count(outputs[0].shape[2])
    message = (
        f"the model has {listed(outputs, 'output')}: expected is one float32 output "
        f"[1, {cells}, 5 + classes], a row for each cell of strides 8, 16 and 32 of its "
        f"{width_px}x{height_px} input"
    )
    raise ModelRefusedError(message)


def _class_names(metadata: dict[str, str], classes: int) -> tuple[str, ...] | None:
    names = class_names_of(metadata)
    if names is not None and len(names) != classes:
        message = f"the metadata entry 'class_names' must be a JSON list of {classes} names"
        raise ModelRefusedError(message)
    return names
