"""The array types of the domain, and how arrays enter its frozen value objects.

Geometry at sea spans kilometres and wants millimetres, and geocentric coordinates are millions of
metres: everything geometric is float64. Value objects keep private, read-only copies, so that
nobody can change a camera behind the back of those who share it.
"""

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
UInt8Array: TypeAlias = npt.NDArray[np.uint8]  # images (height, width, 3), BGR as OpenCV has them
BoolArray: TypeAlias = npt.NDArray[np.bool_]
IntArray: TypeAlias = npt.NDArray[np.intp]  # positions in other arrays
Float32Array: TypeAlias = npt.NDArray[np.float32]  # what neural networks take and give


def frozen_array(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Copy `values` into a read-only float64 array of `shape`.

    Raises ValueError naming `name` when the shape differs or a number is not finite.
    """
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must hold finite numbers only")
    array.flags.writeable = False
    return array


def numbered(names: Iterable[str]) -> IntArray:
    """Return a number for each name, the same for the same one, counted from 0 as they come."""
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(name, len(numbers)) for name in names], dtype=np.intp)
