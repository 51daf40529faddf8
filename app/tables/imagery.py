"""Photographs: bytes by content in the file store, times and sizes here."""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.engine.default import DefaultExecutionContext
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, enum_type, now
from app.tables.deletion import Deletable, index_of_changed, index_of_deleted
from app.tables.sites import Camera, Viewport


class CaptureTimeSource(StrEnum):
    """Where the moment of a photograph came from."""

    GIVEN = "given"
    EXIF = "exif"
    FILE_NAME = "file_name"
    CSV = "csv"
    FILE_TIME = "file_time"


def _as_captured(context: DefaultExecutionContext) -> datetime:
    moment: datetime = context.get_current_parameters()["captured_at"]  # type: ignore[no-untyped-call]  # SQLAlchemy has no types there
    return moment


class Image(Deletable, Base):
    """A photograph of a camera; the same bytes are one image of that camera.

    `captured_at_raw` is the moment its source told; `captured_at` is the one all else goes by.
    `changed_at` is when it was last deleted, brought back or given another time: what exports ask.
    """

    __tablename__ = "images"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    camera_id: Mapped[int] = mapped_column(sa.ForeignKey("cameras.id", ondelete="CASCADE"))
    viewport_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="SET NULL"), index=True
    )
    sha256: Mapped[str] = mapped_column(sa.String(64), index=True)
    media_type: Mapped[str] = mapped_column(sa.String(32))
    file_name: Mapped[str] = mapped_column(sa.String(255))
    size_bytes: Mapped[int]
    width_px: Mapped[int]
    height_px: Mapped[int]
    captured_at: Mapped[datetime]
    captured_at_raw: Mapped[datetime] = mapped_column(default=_as_captured)
    captured_at_source: Mapped[CaptureTimeSource] = mapped_column(enum_type(CaptureTimeSource))
    import_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("image_imports.id", ondelete="SET NULL"), index=True
    )
    created_at: Mapped[datetime] = mapped_column(default=now)
    changed_at: Mapped[datetime | None]

    camera: Mapped[Camera] = relationship()
    viewport: Mapped[Viewport | None] = relationship()

    __table_args__ = (
        sa.UniqueConstraint("camera_id", "sha256"),
        sa.Index("ix_images_camera_time", "camera_id", "captured_at", "id"),
        index_of_deleted("images"),
        index_of_changed("images"),
    )
