"""Requests and answers of calibrations."""

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel, Field

from app.registration.schemas import IntrinsicsOut
from app.sites.fields import Request, matrix_of
from app.tables.calibration import (
    CalibrationPhoto,
    CalibrationSource,
    CalibrationStatus,
    CameraCalibration,
)


class BoardIn(Request):
    """A chequerboard: inner corners in a row and in a column, and the side of a square."""

    columns: int = Field(ge=3, le=40)
    rows: int = Field(ge=3, le=40)
    square_mm: float = Field(gt=0, le=2000)


class LeftOutIn(Request):
    """Which photographs (by number) the solution does without; all others take part."""

    left_out: list[int] = Field(max_length=100, examples=[[3, 7]])


class PhotoOut(BaseModel):
    """A photograph of the board: what was found in it, and how well the lens explains it."""

    number: int
    file_name: str
    is_used: bool
    is_left_out: bool
    problem: str | None
    rms_px: float | None
    tilt_deg: float | None = Field(description="0: the board was seen straight on")
    corners_px: list[list[float]] | None

    @classmethod
    def of(cls, photo: CalibrationPhoto) -> Self:
        """Show a row."""
        return cls(
            number=photo.position,
            file_name=photo.file_name,
            is_used=photo.rms_px is not None,
            is_left_out=photo.is_left_out,
            problem=photo.problem,
            rms_px=photo.rms_px,
            tilt_deg=photo.tilt_deg,
            corners_px=photo.corners,
        )


class CalibrationOut(BaseModel):
    """A version of a camera's intrinsics; `is_active` is the one registrations to come use."""

    id: int
    camera_id: int
    number: int
    source: CalibrationSource
    status: CalibrationStatus
    error: str | None
    columns: int | None
    rows: int | None
    square_mm: float | None
    intrinsics: IntrinsicsOut | None
    deviations: dict[str, Any] | None = Field(description="One sigma of fx, fy, cx, cy, px")
    rms_px: float | None
    coverage: float | None = Field(description="Share of the image that boards reached")
    warnings: list[str]
    is_active: bool
    created_at: datetime
    finished_at: datetime | None
    activated_at: datetime | None
    version: int

    @classmethod
    def of(cls, row: CameraCalibration, *, is_active: bool) -> Self:
        """Show a row."""
        lens = row.intrinsics
        made = {"columns", "rows", "intrinsics", "is_active", "photos"}
        return cls(
            columns=row.corner_columns,
            rows=row.corner_rows,
            intrinsics=IntrinsicsOut(K=matrix_of(lens), **lens) if lens else None,
            is_active=is_active,
            **{name: getattr(row, name) for name in cls.model_fields.keys() - made},
        )


class CalibrationWithPhotosOut(CalibrationOut):
    """A calibration with its photographs."""

    photos: list[PhotoOut] = []
