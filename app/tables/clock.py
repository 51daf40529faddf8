"""Clocks of cameras: how far they were off, by whose word, and what images say of them."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, Json, enum_type, now


class OffsetSource(StrEnum):
    """Whose word an offset is."""

    GIVEN = "given"
    ESTIMATED = "estimated"


class ClockOffset(Base):
    """True time = the camera's clock + `offset_s`, for clock times of [valid_from, valid_until).

    Rows are never changed. Of those that cover a moment and were not undone the newest counts. It
    concerns what a clock told; times that somebody gave only where `concerns_given`.
    """

    __tablename__ = "clock_offsets"

    id: Mapped[int] = mapped_column(primary_key=True)
    camera_id: Mapped[int] = mapped_column(
        sa.ForeignKey("cameras.id", ondelete="CASCADE"), index=True
    )
    valid_from: Mapped[datetime | None]
    valid_until: Mapped[datetime | None]
    offset_s: Mapped[float]
    low_s: Mapped[float | None]
    high_s: Mapped[float | None]
    source: Mapped[OffsetSource] = mapped_column(enum_type(OffsetSource))
    note: Mapped[str] = mapped_column(sa.String(500), default="")
    concerns_given: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    undone_at: Mapped[datetime | None]


class EstimateStatus(StrEnum):
    """Where an estimate stands."""

    QUEUED = "queued"
    SUCCEEDED = "succeeded"
    FAILED = "failed"


class ClockEstimate(Base):
    """What the vessels on a run's images say of its camera's clock.

    Only images of [begin, end) by the camera's clock, where given. `result`: offset_s (true time =
    clock + offset), low_s, high_s, image_count, vessel_count, is_off, message. Where the run found
    this by itself and withheld its matches, also withheld_images and withheld_matches.
    """

    __tablename__ = "clock_estimates"

    id: Mapped[int] = mapped_column(primary_key=True)
    camera_id: Mapped[int] = mapped_column(
        sa.ForeignKey("cameras.id", ondelete="CASCADE"), index=True
    )
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    begin: Mapped[datetime | None]
    end: Mapped[datetime | None]
    status: Mapped[EstimateStatus] = mapped_column(
        enum_type(EstimateStatus), default=EstimateStatus.QUEUED
    )
    error: Mapped[str | None] = mapped_column(sa.Text)
    workflow_id: Mapped[str] = mapped_column(sa.String(64), unique=True)
    result: Mapped[dict[str, Any] | None] = mapped_column(Json)
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
