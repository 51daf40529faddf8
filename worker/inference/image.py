"""Photographs into pixels, upright.

Cameras write into EXIF how to turn what they stored, and viewers obey. So does this: keypoints are
clicked on the picture as it is seen, and a detector finds more in one that does not stand on its
head.
"""

import ctypes
from functools import cache

import cv2
import numpy as np

from app.domain.arrays import UInt8Array
from app.imagery import upright

_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_KEEP_BYTES = 1_000_000_000
_LARGEST_MMAP_THRESHOLD = 32 * 2**20  # glibc refuses more


def decode_image(data: bytes) -> UInt8Array:
    """Decode an image file into (height, width, 3), BGR, upright (see `app.imagery.upright`).

    Raises:
        ValueError: the bytes are no image that OpenCV reads.

    """
    _keep_freed_memory()
    encoded = np.frombuffer(data, dtype=np.uint8)
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    image = cv2.imdecode(encoded, flags) if encoded.size else None
    if image is None:
        raise ValueError("the image cannot be decoded: it is damaged or of an unknown format")
    return upright.turned(np.asarray(image, dtype=np.uint8), upright.orientation_of(data))


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
