"""Batches of photographs on their way in: what was announced, what has arrived, what it told.

A batch collects files until somebody looks at it and commits it; before that no image exists. Its
files are rows from the moment they are announced, so a lost connection or a closed page loses
nothing: whoever comes back asks which files are still waited for.
"""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.sites import Camera


class ImportStatus(StrEnum):
    """Where a batch stands."""

    COLLECTING = "collecting"
    COMMITTED = "committed"
    UNDONE = "undone"
    DISCARDED = "discarded"


class FileState(StrEnum):
    """What became of a file of a batch."""

    WAITING = "waiting"  # announced; not here, or only a part of it
    STAGED = "staged"  # a photograph whose bytes are stored
    KNOWN = "known"  # the camera has these bytes already
    SKIPPED = "skipped"  # hidden, or made by a system: not wanted
    REFUSED = "refused"  # not taken, for the reason told
    UNPACKED = "unpacked"  # an archive whose photographs are files of their own now


class ImageImport(Base):
    """A batch for one camera; `times` says how its files tell when they were taken."""

    __tablename__ = "image_imports"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    camera_id: Mapped[int] = mapped_column(
        sa.ForeignKey("cameras.id", ondelete="CASCADE"), index=True
    )
    name: Mapped[str] = mapped_column(sa.String(200))
    status: Mapped[ImportStatus] = mapped_column(
        enum_type(ImportStatus), default=ImportStatus.COLLECTING
    )
    times: Mapped[dict[str, Any]] = mapped_column(Json)
    image_count: Mapped[int] = mapped_column(default=0)
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    committed_at: Mapped[datetime | None]
    undone_at: Mapped[datetime | None]
    version: Mapped[int] = mapped_column(default=1)

    camera: Mapped[Camera] = relationship()

    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class ImportFile(Base):
    """A file of a batch: where it was, how far it has come, and what it says of itself.

    `path_key` is the SHA-256 of the path as it was sent; `path` is that made fit to be shown.
    `exif_at` and `listed_at` (from a table of times) are ISO 8601, without a zone where none was
    told.
    """

    __tablename__ = "import_files"

    id: Mapped[int] = mapped_column(primary_key=True)
    import_id: Mapped[int] = mapped_column(sa.ForeignKey("image_imports.id", ondelete="CASCADE"))
    path: Mapped[str] = mapped_column(sa.String(500))
    path_key: Mapped[str] = mapped_column(sa.String(64))
    size_bytes: Mapped[int] = mapped_column(sa.BigInteger)
    received_bytes: Mapped[int] = mapped_column(sa.BigInteger, default=0)
    modified_at: Mapped[datetime | None]
    state: Mapped[FileState] = mapped_column(enum_type(FileState), default=FileState.WAITING)
    reason: Mapped[str | None] = mapped_column(sa.Text)
    sha256: Mapped[str | None] = mapped_column(sa.String(64), index=True)
    media_type: Mapped[str | None] = mapped_column(sa.String(32))
    width_px: Mapped[int | None]
    height_px: Mapped[int | None]
    exif_at: Mapped[str | None] = mapped_column(sa.String(40))
    listed_at: Mapped[str | None] = mapped_column(sa.String(40))

    __table_args__ = (
        sa.UniqueConstraint("import_id", "path_key"),
        sa.Index("ix_import_files_state", "import_id", "state", "id"),
    )
