"""What is known of a camera's lens, version by version, and the photographs it was learnt from."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.sites import Camera


class CalibrationSource(StrEnum):
    """Where a camera's intrinsics came from."""

    CHEQUERBOARD = "chequerboard"
    ENTERED = "entered"  # typed in by hand; kept so that one can go back to it


class CalibrationStatus(StrEnum):
    """Where a calibration stands."""

    QUEUED = "queued"
    RUNNING = "running"
    SOLVED = "solved"
    FAILED = "failed"


class CameraCalibration(Base):
    """A version of a camera's intrinsics; the camera uses the one activated last.

    `intrinsics` are as a registration keeps them, `deviations` their standard deviations (fx_px,
    fy_px, cx_px, cy_px). `coverage` is the share of the image that the boards reached.
    """

    __tablename__ = "camera_calibrations"

    id: Mapped[int] = mapped_column(primary_key=True)
    camera_id: Mapped[int] = mapped_column(sa.ForeignKey("cameras.id", ondelete="CASCADE"))
    number: Mapped[int]
    source: Mapped[CalibrationSource] = mapped_column(enum_type(CalibrationSource))
    status: Mapped[CalibrationStatus] = mapped_column(
        enum_type(CalibrationStatus), default=CalibrationStatus.QUEUED
    )
    error: Mapped[str | None] = mapped_column(sa.Text)
    workflow_id: Mapped[str | None] = mapped_column(sa.String(64), unique=True)
    corner_columns: Mapped[int | None]
    corner_rows: Mapped[int | None]
    square_mm: Mapped[float | None]
    intrinsics: Mapped[dict[str, Any] | None] = mapped_column(Json)
    deviations: Mapped[dict[str, Any] | None] = mapped_column(Json)
    rms_px: Mapped[float | None]
    coverage: Mapped[float | None]
    warnings: Mapped[list[str]] = mapped_column(default=list)
    created_at: Mapped[datetime] = mapped_column(default=now)
    finished_at: Mapped[datetime | None]
    activated_at: Mapped[datetime | None]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    activated_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    version: Mapped[int] = mapped_column(default=1)

    camera: Mapped[Camera] = relationship()

    __table_args__ = (sa.UniqueConstraint("camera_id", "number"),)
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class CalibrationPhoto(Base):
    """A photograph of the board: its corners (n, 2) px row by row, or what is wrong with it."""

    __tablename__ = "calibration_photos"

    id: Mapped[int] = mapped_column(primary_key=True)
    calibration_id: Mapped[int] = mapped_column(
        sa.ForeignKey("camera_calibrations.id", ondelete="CASCADE")
    )
    position: Mapped[int]
    file_name: Mapped[str] = mapped_column(sa.String(255))
    sha256: Mapped[str] = mapped_column(sa.String(64))
    media_type: Mapped[str] = mapped_column(sa.String(32))
    corners: Mapped[list[list[float]] | None] = mapped_column(Json)
    problem: Mapped[str | None] = mapped_column(sa.Text)
    is_left_out: Mapped[bool] = mapped_column(default=False)
    rms_px: Mapped[float | None]
    tilt_deg: Mapped[float | None]
    searched_at: Mapped[datetime | None]

    __table_args__ = (sa.UniqueConstraint("calibration_id", "position"),)
