"""Taking photographs in and finding them again.

The same bytes on the same camera are one image, however often and however simultaneously they
arrive: the database's own constraint decides. All slow work (hashing, decoding, writing the file)
happens before the first statement that writes.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import IO

from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database, now
from app.errors import FieldError, Invalid, NotFound, TooLarge
from app.imagery import photo, repository
from app.imagery.captured import captured_at as moment_of
from app.imagery.names import tidy
from app.imagery.preview import WIDTHS_PX, make_preview
from app.imagery.repository import ImageFilter
from app.imagery.span import ImageSpan
from app.imagery.true_time import corrected_times
from app.paging import Paging
from app.sites import service as sites
from app.storage import Storage
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.sites import Camera

NO_IMAGE = "there is no such image"


@dataclass(frozen=True, slots=True)
class Upload:
    """What came in: bytes, the name the sender gave them, and the moment if said."""

    data: bytes
    file_name: str | None = None
    captured_at: datetime | None = None


@dataclass(frozen=True, slots=True)
class Incoming:
    """A photograph that was checked and whose bytes are stored; only its row is missing."""

    site_id: int
    camera_id: int
    sha256: str
    media_type: str
    file_name: str
    size_bytes: int
    width_px: int
    height_px: int
    captured_at: datetime
    captured_at_source: CaptureTimeSource


def store_image(
    database: Database, storage: Storage, settings: Settings, camera_id: int, upload: Upload
) -> tuple[Image, bool]:
    """Take a photograph in; returns its image and whether it is new.

    Raises NotFound (camera), TooLarge, UnsupportedMedia and Invalid as the checks say.
    """
    with database.reading() as session:
        camera = sites.get_camera(session, camera_id)
        known = known_image(session, camera, upload)
    if known is not None:
        return known, False
    incoming = take_in(storage, settings, camera, upload)
    with database.writing() as session:
        return remember(session, incoming)


def known_image(session: Session, camera: Camera, upload: Upload) -> Image | None:
    """Return the camera's present image with the same bytes."""
    sha256 = hashlib.sha256(upload.data).hexdigest()
    image = repository.by_content(session, camera.id, sha256)
    return image if image is not None and image.deleted_at is None else None


def take_in(storage: Storage, settings: Settings, camera: Camera, upload: Upload) -> Incoming:
    """Check a photograph and store its bytes. Raises TooLarge, UnsupportedMedia, Invalid."""
    if len(upload.data) > settings.max_upload_bytes:
        raise TooLarge(
            f"the file is larger than {settings.max_upload_bytes:,} bytes "
            "(QUAYMARK_MAX_UPLOAD_BYTES)"
        )
    header = photo.inspect(upload.data, settings.max_image_pixels)
    _check_size(header, camera)
    file_name = tidy(upload.file_name, header.media_type)
    moment, source = moment_of(
        given=upload.captured_at,
        exif=header.exif_taken_at,
        file_name=file_name,
        pattern=camera.file_name_pattern,
        timezone=camera.timezone,
    )
    photo.check_decodes(upload.data, header)
    stored = storage.put(upload.data)
    return Incoming(
        site_id=camera.site_id,
        camera_id=camera.id,
        sha256=stored.sha256,
        media_type=header.media_type,
        file_name=file_name,
        size_bytes=stored.size_bytes,
        width_px=header.width_px,
        height_px=header.height_px,
        captured_at=moment,
        captured_at_source=source,
    )


def _check_size(header: photo.Photo, camera: Camera) -> None:
    if (header.width_px, header.height_px) == (camera.width_px, camera.height_px):
        return
    message = (
        f"is {header.width_px} x {header.height_px} px, but camera {camera.name!r} takes "
        f"{camera.width_px} x {camera.height_px} px; upload the original, not a resized copy, or "
        "make a camera for this size"
    )
    raise Invalid(f"file: {message}", fields=(FieldError("file", message),))


def remember(session: Session, incoming: Incoming) -> tuple[Image, bool]:
    """Add the row of a photograph that was taken in; returns it and whether it is new.

    A deleted image with the same bytes comes back, with the time it has now been given.
    """
    repository.share_camera(session, incoming.camera_id)
    told = (incoming.captured_at, incoming.captured_at_source)
    (true,) = corrected_times(session, incoming.camera_id, [told])
    viewport_id = repository.viewport_at(session, incoming.camera_id, true)
    times = {"captured_at": true, "captured_at_raw": incoming.captured_at}
    inserted = repository.insert(session, asdict(incoming) | times | {"viewport_id": viewport_id})
    image = repository.by_content(session, incoming.camera_id, incoming.sha256)
    if image is None:
        raise NotFound(sites.NO_CAMERA)
    if image.deleted_at is not None:
        image.deleted_at = image.deletion_id = None
        image.changed_at = now()
        image.file_name = incoming.file_name
        image.captured_at = true
        image.captured_at_raw = incoming.captured_at
        image.captured_at_source = incoming.captured_at_source
        image.viewport_id = viewport_id
        session.flush()
    return image, inserted is not None


def get_image(session: Session, image_id: int) -> Image:
    """Return an image. Raises NotFound, also for a deleted one."""
    image = repository.image(session, image_id)
    if image is None:
        raise NotFound(NO_IMAGE)
    return image


def list_images(
    session: Session, wanted: ImageFilter, paging: Paging
) -> tuple[Sequence[Image], str | None]:
    """Return a page of images in the order they came in."""
    return repository.images(session, wanted, paging)


def images_by_time(
    session: Session, wanted: ImageFilter, after_id: int | None, limit: int
) -> Sequence[Image]:
    """Return up to `limit` images in order of their time, those after the image `after_id`."""
    after = repository.image(session, after_id) if after_id else None
    return repository.images_by_time(session, wanted, after, limit)


def count_images(session: Session, wanted: ImageFilter) -> int:
    """Count images."""
    return repository.count(session, wanted)


def spans_of_cameras(session: Session, camera_ids: Iterable[int]) -> dict[int, ImageSpan]:
    """Return, by camera, how many images there are and from when to when."""
    return repository.spans(session, Image.camera_id, camera_ids)


def spans_of_viewports(session: Session, viewport_ids: Iterable[int]) -> dict[int, ImageSpan]:
    """Return, by viewport, how many images there are and from when to when."""
    return repository.spans(session, Image.viewport_id, viewport_ids)


def neighbours(session: Session, image: Image) -> tuple[int | None, int | None]:
    """Return the ids of the same camera's image before and after one."""
    return (
        repository.neighbour(session, image, later=False),
        repository.neighbour(session, image, later=True),
    )


def hourly_counts(session: Session, camera_id: int) -> Sequence[tuple[str, int]]:
    """Count a camera's images by hour in UTC: (`YYYY-MM-DD HH`, count), in order."""
    return repository.hourly_counts(session, camera_id)


def assign_viewports(session: Session, camera_id: int) -> None:
    """Give a camera's images their viewports anew, after times have changed; mark stale runs."""
    repository.assign_viewports(session, camera_id)
    repository.mark_runs(session, camera_id)


def open_file(storage: Storage, image: Image) -> IO[bytes]:
    """Open a photograph's bytes. Raises NotFound when the store lost them."""
    return storage.open(image.sha256)


def preview(storage: Storage, image: Image, width_px: int) -> bytes:
    """Return a JPEG of one of the fixed widths, made on first use."""
    return storage.derived(
        _preview_name(image.sha256, width_px),
        lambda: make_preview(storage.read(image.sha256), image.media_type, width_px),
    )


def forget_previews(storage: Storage, sha256: str) -> int:
    """Remove the previews that were made of some bytes; returns how many."""
    names = (_preview_name(sha256, width_px) for width_px in WIDTHS_PX)
    return sum(storage.remove_derived(name) for name in names)


def _preview_name(sha256: str, width_px: int) -> str:
    return f"previews/{sha256[:2]}/{sha256}-{width_px}.jpg"
