"""Pictures as they are meant to be seen: turned as EXIF says, in one way wherever pixels are made.

A camera that hangs upside down, or a telephone held upright, stores its pixels as the sensor gives
them and notes in EXIF how to turn them. Browsers obey, some decoders do not, and then "pixel
(u, v)" means two places. Here it means one: pixel coordinates are those of the upright picture, in
the viewer, in previews, for detectors and in the sizes we tell. Bytes stay as they came. Only JPEGs
are turned: of other formats not all browsers obey the tag.

Source: Exif 2.32, 4.6.4 A, tag 274: where row 0 and column 0 of the stored pixels are seen.
"""

import io
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from PIL import ExifTags, Image

from app.imagery.damage import DAMAGED

UPRIGHT = 1
_JPEG = b"\xff\xd8"
Scalar = TypeVar("Scalar", bound=np.generic)


class JpegHeader(NamedTuple):
    """What a JPEG says of itself: the sides as stored, and how they are to be turned, 1 to 8."""

    width_px: int
    height_px: int
    orientation: int


def jpeg_header(data: bytes) -> JpegHeader | None:
    """Return a JPEG's header; None for other formats and for what cannot be read."""
    if not data.startswith(_JPEG):
        return None
    try:
        with Image.open(io.BytesIO(data), formats=("JPEG",)) as picture:
            return JpegHeader(*picture.size, of_picture(picture))
    except DAMAGED:
        return None


def orientation_of(data: bytes) -> int:
    """Return how a photograph's pixels are to be turned, 1 to 8, by its header alone."""
    header = jpeg_header(data)
    return UPRIGHT if header is None else header.orientation


def of_picture(picture: Image.Image) -> int:
    """Return what EXIF says, 1 to 8; other values mean nothing, and viewers ignore them.

    What XMP says is left aside: no browser follows it.
    """
    stored = picture.info.get("exif")
    if not stored:
        return UPRIGHT
    exif = Image.Exif()
    try:
        exif.load(stored)
        orientation = exif.get(ExifTags.Base.Orientation, UPRIGHT)
    except DAMAGED:
        return UPRIGHT
    return int(orientation) if orientation in range(1, 9) else UPRIGHT


def lies_on_its_side(orientation: int) -> bool:
    """Whether rows and columns are exchanged."""
    return orientation >= 5


def turned(pixels: npt.NDArray[Scalar], orientation: int) -> npt.NDArray[Scalar]:
    """Return stored pixels (height, width, ...) upright, in memory of their own where turned."""
    seen = pixels.swapaxes(0, 1) if lies_on_its_side(orientation) else pixels
    if orientation in (3, 4, 7, 8):
        seen = seen[::-1]
    if orientation in (2, 3, 6, 7):
        seen = seen[:, ::-1]
    return np.ascontiguousarray(seen)
