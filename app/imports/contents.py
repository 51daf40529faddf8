"""What the bytes of a photograph say of it, or why they are refused."""

import hashlib
from dataclasses import dataclass
from datetime import datetime

from app.errors import Invalid, TooLarge, UnsupportedMedia
from app.imagery import photo


@dataclass(frozen=True, slots=True)
class Content:
    """What a photograph's bytes tell; `exif_at` is naive where EXIF names no zone."""

    sha256: str
    media_type: str
    width_px: int
    height_px: int
    exif_at: datetime | None


def read(data: bytes, max_pixels: int) -> Content | str:
    """Return what a photograph's bytes tell, or the reason why they are none."""
    try:
        header = photo.inspect(data, max_pixels)
        photo.check_whole(data, header)
    except (Invalid, TooLarge, UnsupportedMedia) as error:
        return error.detail.removeprefix("file: ")
    return Content(
        hashlib.sha256(data).hexdigest(),
        header.media_type,
        header.width_px,
        header.height_px,
        header.exif_taken_at,
    )
