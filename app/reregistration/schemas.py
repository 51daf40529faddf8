"""Requests and answers of re-registrations, of their images and of the pointings they propose."""

from datetime import datetime
from enum import StrEnum
from math import degrees, sqrt
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field

from app.domain.reregistration import MOVEMENT_ALARM_DEG, Gate
from app.ids import RowId
from app.sites.fields import Name, Request
from app.tables.reregistration import (
    Pointing,
    PointingState,
    Reregistration,
    ReregistrationImage,
    ReregistrationStatus,
)

GATE = Gate()
MOMENT_NOTE = "ISO 8601; without a zone it is in the camera's"


class ImageChoice(StrEnum):
    """Which of the camera's images are looked at."""

    UNASSIGNED = "unassigned"  # those no viewport has
    VIEWPORT = "viewport"  # the reference's own: has it moved meanwhile?
    ALL = "all"


class GateIn(Request):
    """What an image must show before its rotation is believed; stricter is safer."""

    inliers: int = Field(GATE.inliers, ge=8, le=5000, description="Points that agree, at least")
    hull_share: float = Field(GATE.hull_share, ge=0.005, le=1, description="Of the image, spanned")
    angle_deg: float = Field(GATE.angle_deg, gt=0, le=45, description="Largest turn")


class ReregistrationIn(Request):
    """Which images to register by turning a viewport's registration."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"images": "unassigned"}, {"images": "all"}]},
        populate_by_name=True,
    )

    images: ImageChoice = ImageChoice.UNASSIGNED
    begin: datetime | None = Field(None, alias="from", description=MOMENT_NOTE)
    end: datetime | None = Field(None, alias="until", description=f"{MOMENT_NOTE}. Not included")
    reference_image_id: RowId | None = Field(
        None, description="The image the viewport was registered on; else its first one"
    )
    nearest_land_m: float | None = Field(
        None, gt=0, le=100_000, description="All that is nearer is water; else from the landmarks"
    )
    same_pointing_deg: float = Field(MOVEMENT_ALARM_DEG, ge=0.005, le=2)
    gate: GateIn = GateIn()
    accept_from_inliers: int | None = Field(
        None,
        ge=15,
        description="Accept a pointing without asking when an image of it has as many; else people",
    )


class ReregistrationOut(BaseModel):
    """A re-registration and how far it is."""

    id: int
    site_id: int
    viewport_id: int
    registration_id: int
    reference_image_id: int
    status: ReregistrationStatus
    error: str | None
    settings: dict[str, Any]
    images_total: int
    images_done: int
    images_passed: int
    images_refused: int
    images_per_s: float | None
    remaining_s: float | None
    pointings: int
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None

    @classmethod
    def of(cls, row: Reregistration, counts: "Counts") -> Self:
        """Show a row."""
        own = {name: getattr(row, name) for name in cls.model_fields if hasattr(row, name)}
        done = counts.passed + counts.refused
        rate = None
        if row.started_at is not None and counts.last_done_at is not None and done:
            rate = done / max((counts.last_done_at - row.started_at).total_seconds(), 1e-3)
        is_open = row.status in {ReregistrationStatus.QUEUED, ReregistrationStatus.RUNNING}
        return cls(
            **own,
            images_total=row.image_count,
            images_done=done,
            images_passed=counts.passed,
            images_refused=counts.refused,
            images_per_s=rate,
            remaining_s=(row.image_count - done) / rate if rate and is_open else None,
            pointings=counts.pointings,
        )


class Counts(BaseModel):
    """How many images of a re-registration are done."""

    passed: int = 0
    refused: int = 0
    pointings: int = 0
    last_done_at: datetime | None = None


class TurnedImageOut(BaseModel):
    """What came of an image: how it is turned, or why it stays unregistered.

    `rotation_from_reference` is a Rodrigues vector: it turns the reference's camera frame into the
    image's. A refused image's is for looking at only. `uncertainty_deg` is a standard deviation.
    """

    image_id: int
    file_name: str
    captured_at: datetime
    passed: bool | None = Field(description="null while it is not done")
    refusal: str | None
    message: str | None
    rotation_from_reference: list[float] | None
    angle_deg: float | None
    uncertainty_deg: float | None
    inliers: int | None
    hull_share: float | None
    rmse_px: float | None
    keyframe_ids: list[int]
    moved: bool | None = Field(description="Whether it is turned by more than the movement alarm")
    pointing_id: int | None

    @classmethod
    def of(cls, row: ReregistrationImage) -> Self:
        """Show a row."""
        passed = None if row.done_at is None else row.refusal is None
        return cls(
            image_id=row.image_id,
            file_name=row.image.file_name,
            captured_at=row.image.captured_at,
            passed=passed,
            refusal=row.refusal,
            message=row.message,
            rotation_from_reference=row.rotation_from_reference,
            angle_deg=row.angle_deg,
            uncertainty_deg=uncertainty_deg(row.covariance),
            inliers=row.inliers,
            hull_share=row.hull_share,
            rmse_px=row.rmse_px,
            keyframe_ids=row.keyframe_ids,
            moved=row.angle_deg > MOVEMENT_ALARM_DEG if passed and row.angle_deg else None,
            pointing_id=row.pointing_id,
        )


class PointingOut(BaseModel):
    """Neighbours in time that look the same way: a viewport, once somebody accepts it."""

    id: int
    reregistration_id: int
    position: int
    rotation_from_reference: list[float]
    angle_deg: float
    uncertainty_deg: float | None
    moved: bool = Field(description="Whether it is turned by more than the movement alarm")
    first_at: datetime
    last_at: datetime
    image_count: int
    state: PointingState
    viewport_id: int | None
    note: str | None
    decided_at: datetime | None

    @classmethod
    def of(cls, row: Pointing) -> Self:
        """Show a row."""
        made = {"uncertainty_deg", "moved"}
        return cls(
            **{name: getattr(row, name) for name in cls.model_fields.keys() - made},
            uncertainty_deg=uncertainty_deg(row.covariance),
            moved=row.angle_deg > MOVEMENT_ALARM_DEG,
        )


class AcceptIn(Request):
    """How the accepted pointing's viewport is called and for which times it holds."""

    name: Name | None = Field(None, description="Else the reference's name and the first time")
    valid_from: datetime | None = Field(None, description=f"{MOMENT_NOTE}. Else its first image")
    valid_until: datetime | None = Field(
        None,
        description=f"{MOMENT_NOTE}. Not included. Else the next pointing or viewport, or open",
    )


def uncertainty_deg(covariance: list[list[float]] | None) -> float | None:
    """Return the standard deviation of a turn, its three axes together, degrees."""
    if covariance is None:
        return None
    return degrees(sqrt(sum(covariance[axis][axis] for axis in range(3))))
