"""Shapes of clock offsets and estimates in REST."""

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from app.ids import RowId
from app.tables.clock import ClockEstimate, ClockOffset, EstimateStatus, OffsetSource

RANGE = "By the camera's clock; without a zone in the camera's. Left out: open"


class OffsetIn(BaseModel):
    """True time = the camera's clock + `offset_s`; or what an estimate proposed."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"offset_s": 90.0, "valid_from": "2026-11-22T10:00:00Z"}]},
    )

    offset_s: Annotated[float | None, Field(description="Positive for a slow clock")] = None
    valid_from: Annotated[datetime | None, Field(description=RANGE)] = None
    valid_until: Annotated[datetime | None, Field(description=RANGE)] = None
    note: Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x1f\x7f]*$")] = ""
    concerns_given: Annotated[
        bool, Field(description="Also times that somebody gave, or a table")
    ] = False
    estimate_id: Annotated[
        RowId | None, Field(description="Take offset, range and interval from this estimate")
    ] = None


class OffsetOut(BaseModel):
    """One entry of a camera's clock history; the newest that was not undone counts."""

    id: int
    camera_id: int
    offset_s: float
    low_s: float | None
    high_s: float | None
    valid_from: datetime | None
    valid_until: datetime | None
    source: OffsetSource
    note: str
    concerns_given: bool
    created_at: datetime
    undone_at: datetime | None

    @classmethod
    def of(cls, row: ClockOffset) -> Self:
        """Show a row."""
        return cls(**{name: getattr(row, name) for name in cls.model_fields})


class EstimateIn(BaseModel):
    """Which images shall tell of the clock."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"run_id": 1}]})

    run_id: RowId
    begin: Annotated[datetime | None, Field(description=RANGE)] = None
    end: Annotated[datetime | None, Field(description=RANGE)] = None


class EstimateOut(BaseModel):
    """What the vessels on a run's images say of the clock; `result` is empty until it is done."""

    id: int
    camera_id: int
    run_id: int
    begin: datetime | None
    end: datetime | None
    status: EstimateStatus
    error: str | None
    result: dict[str, Any] | None
    created_at: datetime

    @classmethod
    def of(cls, row: ClockEstimate) -> Self:
        """Show a row."""
        return cls(**{name: getattr(row, name) for name in cls.model_fields})


class WithheldOut(BaseModel):
    """Matches that a run withheld because the vessels say that the camera's clock is off.

    True time = the clock + `offset_s`, for clock times of [begin, end). To correct the clock, post
    the `estimate_id` to the camera's clock-offsets; then start the run again.
    """

    reason: Literal["clock suspect"] = "clock suspect"
    message: str
    begin: datetime | None
    end: datetime | None
    images: int
    matches: int
    offset_s: float
    low_s: float
    high_s: float
    camera_id: int
    estimate_id: int

    @classmethod
    def of(cls, row: ClockEstimate) -> Self:
        """Show what a run found."""
        result = row.result or {}
        return cls(
            message=result["message"],
            begin=row.begin,
            end=row.end,
            images=result["withheld_images"],
            matches=result["withheld_matches"],
            offset_s=result["offset_s"],
            low_s=result["low_s"],
            high_s=result["high_s"],
            camera_id=row.camera_id,
            estimate_id=row.id,
        )
