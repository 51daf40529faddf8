"""What bytes are before they are believed: format, size and decodability of a photograph.

The header alone decides first, with only three formats tried, so that a pixel bomb or a web page
in disguise never reaches a decoder. Then comes the question whether the picture is whole: a file
that breaks off half way would otherwise fail in a worker, hours later. A single upload is decoded
once for it. Of thousands that come together, a JPEG that ends with its end marker counts as whole.

The size is that of the upright picture (see `upright`). A picture of another format than JPEG that
EXIF says to turn is refused: not all browsers turn it, so "pixel (u, v)" would mean two places.
"""

import io
import re
from dataclasses import dataclass
from datetime import datetime

import simplejpeg
from PIL import Image, UnidentifiedImageError

from app import archives
from app.errors import Invalid, TooLarge, UnsupportedMedia
from app.imagery import upright
from app.imagery.damage import DAMAGED
from app.imagery.exif_time import taken

MEDIA_TYPES = {
    "JPEG": "image/jpeg",
    "MPO": "image/jpeg",  # a JPEG with further pictures behind it
    "PNG": "image/png",
    "WEBP": "image/webp",
}
MAGIC = re.compile(rb"\xff\xd8\xff|\x89PNG\r\n\x1a\n|RIFF....WEBP", re.DOTALL)
_JPEG_END = b"\xff\xd9"
_TAIL_BYTES = 1 << 16
# Cheap cameras pad their files; libjpeg warns and decodes every pixel.
HARMLESS = re.compile(r"extraneous bytes before marker")
# Our own limit is checked on every header; Pillow's fixed one would get in its way.
Image.MAX_IMAGE_PIXELS = None


@dataclass(frozen=True, slots=True)
class Photo:
    """A photograph's header: media type, upright size in px, and the moment its EXIF tells.

    `exif_taken_at` is naive where EXIF tells no zone.
    """

    media_type: str
    width_px: int
    height_px: int
    exif_taken_at: datetime | None


def inspect(data: bytes, max_pixels: int) -> Photo:
    """Read a photograph's header without decoding it.

    Raises UnsupportedMedia for anything but JPEG, PNG and WebP, TooLarge for too many pixels,
    Invalid for a broken header or a picture that cannot be turned as EXIF says.
    """
    try:
        with Image.open(io.BytesIO(data), formats=("JPEG", "PNG", "WEBP")) as picture:
            width_px, height_px = picture.size
            media_type = MEDIA_TYPES[str(picture.format)]
            _refuse_too_many_pixels(width_px, height_px, max_pixels)
            orientation, taken_at = upright.of_picture(picture), taken(picture)
    except MemoryError as error:
        raise TooLarge("the picture has far too many pixels") from error
    except DAMAGED as error:
        if isinstance(error, UnidentifiedImageError) and not MAGIC.match(data):
            raise UnsupportedMedia(f"file: {_other_kind(data)}") from error
        raise Invalid.field("file", "has a broken header; export the picture again") from error
    if orientation != upright.UPRIGHT and media_type != "image/jpeg":
        raise Invalid.field(
            "file",
            "its EXIF orientation says to turn it, which not all viewers do in this format; "
            "turn the pixels, remove the tag (exiftool -Orientation= FILE) or upload a JPEG",
        )
    if upright.lies_on_its_side(orientation):
        width_px, height_px = height_px, width_px
    return Photo(media_type, width_px, height_px, taken_at)


def _other_kind(data: bytes) -> str:
    if archives.MAGIC.match(data):
        return (
            "is a zip archive; unpack it and upload the photographs in it: the camera's page takes "
            "all of a folder at once, `quaymark import images` folders within folders too"
        )
    return "is neither JPEG nor PNG nor WebP"


def check_decodes(data: bytes, photo: Photo) -> None:
    """Decode the picture once, JPEG at an eighth of its size. Raises Invalid when it breaks off."""
    try:
        if photo.media_type == "image/jpeg":
            _check_jpeg(data, photo)
        else:
            with Image.open(io.BytesIO(data), formats=("PNG", "WEBP")) as picture:
                picture.load()
    except DAMAGED as error:
        raise Invalid.field(
            "file", f"is cut off or damaged ({error}); upload the whole file again"
        ) from error


def check_whole(data: bytes, photo: Photo) -> None:
    """Check that a picture does not break off, without decoding a JPEG that shows its end.

    Cameras on a full disk leave a tail of zeros instead of pixels; a few put zeros behind the end.
    Raises Invalid when it breaks off.
    """
    ends = photo.media_type == "image/jpeg" and data[-_TAIL_BYTES:].rstrip(b"\0")[-2:] == _JPEG_END
    if not ends:
        check_decodes(data, photo)


def _check_jpeg(data: bytes, photo: Photo) -> None:
    try:
        shorter_px = min(photo.width_px, photo.height_px)  # whichever of both is stored as width
        simplejpeg.decode_jpeg(data, "GRAY", fastdct=True, min_width=-(-shorter_px // 8))
    except ValueError as error:
        if not HARMLESS.search(str(error)):
            raise


def _refuse_too_many_pixels(width_px: int, height_px: int, max_pixels: int) -> None:
    if width_px * height_px > max_pixels:
        raise TooLarge(
            f"the picture has {width_px} x {height_px} px; this installation takes at most "
            f"{max_pixels:,} px (QUAYMARK_MAX_IMAGE_PIXELS)"
        )
