"""Where a camera looked in photographs nobody registered by hand: jobs, images and pointings."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.imagery import Image
from app.tables.registration import Registration
from app.tables.sites import Viewport


class ReregistrationStatus(StrEnum):
    """Where a re-registration stands."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


class PointingState(StrEnum):
    """What was decided of a pointing."""

    PROPOSED = "proposed"
    ACCEPTED = "accepted"
    REJECTED = "rejected"


class Reregistration(Base):
    """One pass over images, from a viewport whose registration a person made."""

    __tablename__ = "reregistrations"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    viewport_id: Mapped[int] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="CASCADE"), index=True
    )
    registration_id: Mapped[int] = mapped_column(
        sa.ForeignKey("registrations.id", ondelete="CASCADE")
    )
    reference_image_id: Mapped[int] = mapped_column(sa.ForeignKey("images.id", ondelete="CASCADE"))
    settings: Mapped[dict[str, Any]]
    status: Mapped[ReregistrationStatus] = mapped_column(
        enum_type(ReregistrationStatus), default=ReregistrationStatus.QUEUED
    )
    error: Mapped[str | None] = mapped_column(sa.Text)
    workflow_id: Mapped[str] = mapped_column(sa.String(64), unique=True)
    image_count: Mapped[int] = mapped_column(default=0)
    created_at: Mapped[datetime] = mapped_column(default=now)
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )

    viewport: Mapped[Viewport] = relationship()
    registration: Mapped[Registration] = relationship()
    reference_image: Mapped[Image] = relationship()


class Pointing(Base):
    """Neighbours in time that look the same way: the proposal of a viewport.

    `rotation_from_reference` is the Rodrigues vector of the reference's camera frame into this
    one; `covariance` (3, 3) is of the turn about this camera's axes, rad^2.
    """

    __tablename__ = "pointings"

    id: Mapped[int] = mapped_column(primary_key=True)
    reregistration_id: Mapped[int] = mapped_column(
        sa.ForeignKey("reregistrations.id", ondelete="CASCADE"), index=True
    )
    position: Mapped[int]
    rotation_from_reference: Mapped[list[float]] = mapped_column(Json)
    angle_deg: Mapped[float]
    covariance: Mapped[list[list[float]]] = mapped_column(Json)
    first_at: Mapped[datetime]
    last_at: Mapped[datetime]
    image_count: Mapped[int]
    state: Mapped[PointingState] = mapped_column(
        enum_type(PointingState), default=PointingState.PROPOSED
    )
    decided_at: Mapped[datetime | None]
    decided_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    viewport_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="SET NULL")
    )
    note: Mapped[str | None] = mapped_column(sa.Text)
    version: Mapped[int] = mapped_column(default=1)

    reregistration: Mapped[Reregistration] = relationship()

    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class ReregistrationImage(Base):
    """An image of a re-registration; `done_at` is set with what came of it.

    `refusal` is null for an image that passed the gate; `rotation_from_reference` of a refused one
    is for looking at only. `covariance` is as a pointing's.
    """

    __tablename__ = "reregistration_images"

    reregistration_id: Mapped[int] = mapped_column(
        sa.ForeignKey("reregistrations.id", ondelete="CASCADE"), primary_key=True
    )
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    position: Mapped[int]
    pointing_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("pointings.id", ondelete="SET NULL")
    )
    refusal: Mapped[str | None] = mapped_column(sa.String(32))
    message: Mapped[str | None] = mapped_column(sa.Text)
    rotation_from_reference: Mapped[list[float] | None] = mapped_column(Json)
    covariance: Mapped[list[list[float]] | None] = mapped_column(Json)
    angle_deg: Mapped[float | None]
    inliers: Mapped[int | None]
    hull_share: Mapped[float | None]
    rmse_px: Mapped[float | None]
    keyframe_ids: Mapped[list[int]] = mapped_column(default=list)
    attempts: Mapped[int] = mapped_column(default=0)
    done_at: Mapped[datetime | None]

    image: Mapped[Image] = relationship(lazy="joined")

    __table_args__ = (
        sa.Index("ix_reregistration_images_position", "reregistration_id", "position"),
    )
