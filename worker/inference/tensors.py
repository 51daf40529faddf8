"""Reading a model's signature: which input is the photograph, and what is fixed about it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array
from worker.inference.session import ModelRefusedError, OnnxSession, TensorSignature

DType = np.dtype[np.generic]
FLOATS: dict[str, DType] = {
    "tensor(float)": np.dtype(np.float32),
    "tensor(float16)": np.dtype(np.float16),
}
INTEGERS: dict[str, DType] = {
    "tensor(int64)": np.dtype(np.int64),
    "tensor(int32)": np.dtype(np.int32),
}
_MASKS: dict[str, DType] = FLOATS | INTEGERS | {"tensor(bool)": np.dtype(np.bool_)}
_LARGEST_SIDE_PX = 8192


@dataclass(frozen=True, slots=True)
class ImageInput:
    """The input for the photograph: rank 4, or 3 without a batch; its size, None where free."""

    name: str
    dtype: DType
    rank: int
    width_px: int | None
    height_px: int | None

    def feed(self, tensor: Float32Array) -> npt.NDArray[np.generic]:
        """Return a tensor (1, 3, height, width) in the rank and type that is wanted."""
        values = tensor if self.rank == 4 else tensor[0]
        return np.ascontiguousarray(values, dtype=self.dtype)

    def fixed_px(self) -> tuple[int, int] | None:
        """Return width and height when both are fixed."""
        if self.width_px is None or self.height_px is None:
            return None
        return self.width_px, self.height_px


def image_input_of(session: OnnxSession) -> ImageInput | None:
    """Return the one input that takes three channels first, as float; None without such a one."""
    found = [image for tensor in session.inputs if (image := _image_input(tensor)) is not None]
    return found[0] if len(found) == 1 else None


def _image_input(tensor: TensorSignature) -> ImageInput | None:
    shape = tensor.shape
    if tensor.element_type not in FLOATS or len(shape) not in {3, 4}:
        return None
    if len(shape) == 4 and not is_one(shape[0]):
        return None
    channels, height, width = shape[-3:]
    sides = (fixed(height), fixed(width))
    if fixed(channels) not in {3, None} or any((side or 1) > _LARGEST_SIDE_PX for side in sides):
        return None
    if len(shape) == 3 and fixed(channels) is None and None in sides:
        return None  # three free dimensions may mean anything
    return ImageInput(tensor.name, FLOATS[tensor.element_type], len(shape), sides[1], sides[0])


def fixed(dimension: int | str | None) -> int | None:
    """Return a dimension's size, None for a free one (a name, nothing, or a negative number)."""
    return dimension if isinstance(dimension, int) and dimension > 0 else None


def is_one(dimension: int | str | None) -> bool:
    """Whether a dimension may be 1, such as a batch of one photograph."""
    return fixed(dimension) in {1, None}


def may_be(tensor: TensorSignature, *shape: int | None) -> bool:
    """Whether a tensor may have this shape; None stands for any size, and free ones fit all."""
    return len(tensor.shape) == len(shape) and all(
        wanted is None or fixed(there) in {wanted, None}
        for there, wanted in zip(tensor.shape, shape, strict=True)
    )


def mask_of(tensor: TensorSignature, width_px: int, height_px: int) -> npt.NDArray[np.generic]:
    """Return a mask that says "photograph" everywhere, in the type and size that is wanted."""
    rows = fixed(tensor.shape[1]) or height_px
    columns = fixed(tensor.shape[2]) or width_px
    return np.ones((1, rows, columns), dtype=_MASKS[tensor.element_type])


def is_mask(tensor: TensorSignature) -> bool:
    """Whether an input tells photograph from padding: [1, height, width]."""
    return tensor.element_type in _MASKS and len(tensor.shape) == 3 and is_one(tensor.shape[0])


def listed(tensors: Sequence[TensorSignature], kind: str) -> str:
    """Return tensors as a person reads them: `2 outputs: 'dets' tensor(float) [1, 100, 5], ...`."""
    names = ", ".join(str(tensor) for tensor in tensors)
    return f"{len(tensors)} {kind}{'' if len(tensors) == 1 else 's'}: {names}"


def refuse(session: OnnxSession, family: str, expected: str) -> ModelRefusedError:
    """Return the error for a model that does not fit: what was seen and what is expected."""
    return ModelRefusedError(
        f"the model has {listed(session.inputs, 'input')}; {listed(session.outputs, 'output')}. "
        f"That is no {family}: expected is {expected}"
    )
