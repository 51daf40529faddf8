"""Taking photographs of a chequerboard in: each is checked and stored before any row is written."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

from app.config import Settings
from app.errors import AppError, FieldError, Invalid, TooLarge, UnsupportedMedia
from app.imagery import photo
from app.imagery.names import tidy
from app.storage import Storage

MOST_PHOTOS = 60
FIELD = "files"


@dataclass(frozen=True, slots=True)
class Taken:
    """A photograph that was checked and whose bytes are stored."""

    sha256: str
    media_type: str
    file_name: str
    width_px: int
    height_px: int


def take_in(
    storage: Storage, settings: Settings, files: Sequence[tuple[str | None, BinaryIO]]
) -> list[Taken]:
    """Check photographs and store their bytes.

    Raises TooLarge, UnsupportedMedia, Invalid naming the file; the same bytes twice are one.
    """
    if not files:
        raise Invalid.field(FIELD, "choose at least three photographs of the board")
    if len(files) > MOST_PHOTOS:
        raise Invalid.field(FIELD, f"at most {MOST_PHOTOS} photographs make a calibration")
    checked = [_checked(settings, name, stream) for name, stream in files]
    taken: dict[str, Taken] = {}
    for (name, stream), header in zip(files, checked, strict=True):
        stream.seek(0)
        stored = storage.put(stream.read(settings.max_upload_bytes))
        taken.setdefault(
            stored.sha256,
            Taken(
                stored.sha256,
                header.media_type,
                tidy(name, header.media_type),
                header.width_px,
                header.height_px,
            ),
        )
    return list(taken.values())


def _checked(settings: Settings, name: str | None, stream: BinaryIO) -> photo.Photo:
    data = stream.read(settings.max_upload_bytes + 1)
    shown = tidy(name, "image/jpeg")
    if len(data) > settings.max_upload_bytes:
        raise _named(shown, TooLarge(f"is larger than {settings.max_upload_bytes:,} bytes"))
    try:
        header = photo.inspect(data, settings.max_image_pixels)
        photo.check_decodes(data, header)
    except (TooLarge, UnsupportedMedia, Invalid) as error:
        raise _named(shown, error) from error
    return header


def _named(name: str, error: AppError) -> AppError:
    message = f"{name}: {error.detail.removeprefix('file: ')}"
    return type(error)(message, fields=(FieldError(FIELD, message),))
