"""Photographs as bytes, and rows of images."""

import hashlib
import io
from datetime import UTC, datetime

import numpy as np
from PIL import ExifTags
from PIL import Image as Picture
from sqlalchemy.orm import Session

from app.tables.imagery import CaptureTimeSource, Image
from app.tables.sites import Camera, Viewport

NOON = datetime(2026, 11, 22, 12, tzinfo=UTC)


def photograph(
    seed: int = 0,
    width_px: int = 64,
    height_px: int = 48,
    *,
    kind: str = "JPEG",
    taken: str | None = None,
    offset: str | None = None,
    orientation: int | None = None,
) -> bytes:
    """Return a small noisy photograph, with EXIF where asked for."""
    noise = np.random.default_rng(seed).integers(0, 255, (height_px, width_px, 3), dtype=np.uint8)
    exif = Picture.Exif()
    exif[ExifTags.Base.Software] = "test"  # Pillow writes no EXIF into a PNG that has only details
    details = exif.get_ifd(ExifTags.IFD.Exif)
    if taken is not None:
        details[ExifTags.Base.DateTimeOriginal] = taken
    if offset is not None:
        details[ExifTags.Base.OffsetTimeOriginal] = offset
    if orientation is not None:
        exif[ExifTags.Base.Orientation] = orientation
    target = io.BytesIO()
    Picture.fromarray(noise).save(target, kind, exif=exif)
    return target.getvalue()


def make_image(
    session: Session,
    camera: Camera,
    viewport: Viewport | None = None,
    captured_at: datetime = NOON,
    **columns: object,
) -> Image:
    """Insert an image's row; its bytes are stored nowhere."""
    values: dict[str, object] = {
        "site_id": camera.site_id,
        "camera_id": camera.id,
        "viewport_id": viewport.id if viewport else None,
        "sha256": hashlib.sha256(f"{camera.id} {captured_at}".encode()).hexdigest(),
        "media_type": "image/jpeg",
        "file_name": f"{captured_at:%Y%m%d_%H%M%S}.jpg",
        "size_bytes": 1000,
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "captured_at": captured_at,
        "captured_at_source": CaptureTimeSource.GIVEN,
    }
    image = Image(**(values | columns))
    session.add(image)
    session.flush()
    return image
