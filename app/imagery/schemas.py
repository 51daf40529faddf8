"""Answers about images."""

from datetime import datetime
from typing import Self

from pydantic import BaseModel, ConfigDict
from pydantic.config import JsonDict

from app.tables.imagery import CaptureTimeSource, Image

IMAGE_EXAMPLE: JsonDict = {
    "id": 5,
    "site_id": 1,
    "camera_id": 1,
    "viewport_id": 1,
    "file_name": "cam_20261122_100005.jpg",
    "captured_at": "2026-11-22T10:00:05Z",
    "captured_at_source": "file_name",
    "media_type": "image/jpeg",
    "width_px": 2560,
    "height_px": 1920,
    "size_bytes": 320231,
    "sha256": "9a0364b9e99bb480dd25e1f0284c8555f0b9dd4b3b0f1f3c6d3a2f0d7d1c2e44",
    "created_at": "2026-11-23T08:12:00Z",
    "file_url": "/api/v1/images/5/file?v=9a0364b9e99b",
    "preview_url": "/api/v1/images/5/preview?width=1280&v=9a0364b9e99b",
}


class ImageOut(BaseModel):
    """A photograph; the URLs change with the bytes, so what they give may be kept for ever."""

    model_config = ConfigDict(json_schema_extra={"examples": [IMAGE_EXAMPLE]})

    id: int
    site_id: int
    camera_id: int
    viewport_id: int | None
    file_name: str
    captured_at: datetime
    captured_at_source: CaptureTimeSource
    media_type: str
    width_px: int
    height_px: int
    size_bytes: int
    sha256: str
    created_at: datetime
    file_url: str
    preview_url: str

    @classmethod
    def of(cls, image: Image) -> Self:
        """Show a row."""
        names = [name for name in cls.model_fields if not name.endswith("_url")]
        return cls(
            file_url=file_url(image),
            preview_url=preview_url(image, 1280),
            **{name: getattr(image, name) for name in names},
        )


def file_url(image: Image) -> str:
    """Return where a photograph's own bytes are."""
    return f"/api/v1/images/{image.id}/file?v={image.sha256[:12]}"


def preview_url(image: Image, width_px: int) -> str:
    """Return where a photograph's preview of a width is."""
    return f"/api/v1/images/{image.id}/preview?width={width_px}&v={image.sha256[:12]}"
