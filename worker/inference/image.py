"""Photographs into pixels, upright.

Cameras write into EXIF how to turn what they stored, and viewers obey. So does this: keypoints are
clicked on the picture as it is seen, and a detector finds more in one that does not stand on its
head.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from app.domain.arrays import UInt8Array
from app.imagery import upright

_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_KEEP_BYTES = 1_000_000_000
_LARGEST_MMAP_THRESHOLD = 32 * 2**20  # glibc refuses more


_REDUCED = {
    2: cv2.IMREAD_REDUCED_COLOR_2,
    4: cv2.IMREAD_REDUCED_COLOR_4,
    8: cv2.IMREAD_REDUCED_COLOR_8,
}
DivisorOf = Callable[[tuple[int, int]], int]


@dataclass(frozen=True, slots=True, eq=False)
class Photograph:
    """Upright pixels (height, width, 3), BGR, maybe reduced; and the whole picture's size, px."""

    pixels_bgr: UInt8Array
    width_px: int
    height_px: int


def decode_photograph(data: bytes, divisor_of: DivisorOf) -> Photograph:
    """Decode an image file as `decode_image` does, a JPEG by `divisor_of` its size smaller.

    Args:
        data: the file.
        divisor_of: says by width and height of the upright picture how much smaller its sides may
            be decoded (see `app.domain.reduced_decoding`).

    Raises:
        ValueError: the bytes are no image that OpenCV reads.

    """
    header = upright.jpeg_header(data)
    if header is not None:
        size = header.width_px, header.height_px
        seen = size[::-1] if upright.lies_on_its_side(header.orientation) else size
        divisor = divisor_of(seen)
        if divisor > 1:
            reduced = _decoded(data, _REDUCED[divisor])
            if reduced.shape[1::-1] == tuple(side // divisor for side in size):
                return Photograph(upright.turned(reduced, header.orientation), *seen)
    whole = decode_image(data)
    return Photograph(whole, whole.shape[1], whole.shape[0])


def decode_image(data: bytes) -> UInt8Array:
    """Decode an image file into (height, width, 3), BGR, upright (see `app.imagery.upright`).

    Raises:
        ValueError: the bytes are no image that OpenCV reads.

    """
    return upright.turned(_decoded(data, cv2.IMREAD_COLOR), upright.orientation_of(data))


def _decoded(data: bytes, scale: int) -> UInt8Array:
    _keep_freed_memory()
    encoded = np.frombuffer(data, dtype=np.uint8)
    flags = scale | cv2.IMREAD_IGNORE_ORIENTATION
    image = cv2.imdecode(encoded, flags) if encoded.size else None
    if image is None:
        raise ValueError("the image cannot be decoded: it is damaged or of an unknown format")
    return np.asarray(image, dtype=np.uint8)


@cache
def _keep_freed_memory() -> None:
    """Keep the memory of one image for the next one: decoding then takes half the time.

    glibc returns such large blocks to the system each time, and the system fills them with zeros
    page by page when they are asked for again. Elsewhere than on glibc nothing is changed.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return
    mallopt(_M_TRIM_THRESHOLD, _KEEP_BYTES)
    mallopt(_M_MMAP_THRESHOLD, _LARGEST_MMAP_THRESHOLD)
