"""Recordings that were sent and are looked at before they are imported.

The bytes are stored when they arrive, so that they need not be sent twice; the row goes when they
are imported, and after a day if nobody wants them. While the worker imports, it says how far it is.
"""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, Json, enum_type, now


class UploadState(StrEnum):
    """Where an upload stands."""

    WAITING = "waiting"  # for somebody to look at it
    QUEUED = "queued"
    IMPORTING = "importing"
    IMPORTED = "imported"
    FAILED = "failed"
    CANCELLED = "cancelled"


class AisUpload(Base):
    """A recording on its way in; `mapping` is what somebody said of its table's columns."""

    __tablename__ = "ais_uploads"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True
    )
    sha256: Mapped[str] = mapped_column(sa.String(64))
    file_name: Mapped[str] = mapped_column(sa.String(255))
    size_bytes: Mapped[int] = mapped_column(sa.BigInteger)
    mapping: Mapped[dict[str, Any] | None] = mapped_column(Json)
    state: Mapped[UploadState] = mapped_column(enum_type(UploadState), default=UploadState.WAITING)
    progress: Mapped[float] = mapped_column(default=0.0)  # from 0 to 1
    reason: Mapped[str | None] = mapped_column(sa.Text)  # why it was not imported
    file_id: Mapped[int | None] = mapped_column(sa.ForeignKey("ais_files.id", ondelete="SET NULL"))
    workflow_id: Mapped[str] = mapped_column(sa.String(64), unique=True)
    created_at: Mapped[datetime] = mapped_column(default=now)
    started_at: Mapped[datetime | None]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
