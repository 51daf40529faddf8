"""Exports: what was asked for, how far it is, and the file that came of it."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, Json, enum_type, now


class ExportStatus(StrEnum):
    """Where an export stands."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


class Export(Base):
    """One export; its bytes are in the file store under their SHA-256.

    `item_count` of `item_total` poses are written. `options` say how: photographs, archive, split.
    """

    __tablename__ = "exports"

    id: Mapped[int] = mapped_column(primary_key=True)
    format: Mapped[str] = mapped_column(sa.String(16))
    filters: Mapped[dict[str, Any]]
    site_ids: Mapped[list[int] | None]
    anonymise: Mapped[bool]
    status: Mapped[ExportStatus] = mapped_column(
        enum_type(ExportStatus), default=ExportStatus.QUEUED
    )
    error: Mapped[str | None] = mapped_column(sa.Text)
    workflow_id: Mapped[str] = mapped_column(sa.String(64), unique=True)
    options: Mapped[dict[str, Any]] = mapped_column(
        Json, default=dict, server_default=sa.text("'{}'")
    )
    item_total: Mapped[int | None]
    item_count: Mapped[int | None]
    manifest: Mapped[dict[str, Any] | None] = mapped_column(Json, deferred=True)
    sha256: Mapped[str | None] = mapped_column(sa.String(64))
    size_bytes: Mapped[int | None]
    created_at: Mapped[datetime] = mapped_column(default=now)
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
