"""What people say of poses and images: verdicts, corrections, vessels nobody found."""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.identity import User


class Grade(StrEnum):
    """A reviewer's verdict on a pose (paper, evaluation)."""

    GOOD = "good"
    OK = "ok"
    BAD = "bad"
    WRONG = "wrong"


class MissedReason(StrEnum):
    """Why a visible vessel has no pose."""

    NOT_DETECTED = "not_detected"
    NO_AIS = "no_ais"
    NEITHER = "neither"
    COST_TOO_HIGH = "cost_too_high"


class Review(Base):
    """A person's verdict on a pose. A later one by the same person replaces it; both are kept."""

    __tablename__ = "reviews"

    id: Mapped[int] = mapped_column(primary_key=True)
    pose_id: Mapped[int] = mapped_column(sa.ForeignKey("poses.id", ondelete="CASCADE"))
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    grade: Mapped[Grade] = mapped_column(enum_type(Grade))
    reasons: Mapped[list[str]]
    comment: Mapped[str | None] = mapped_column(sa.Text)
    seconds: Mapped[float | None]
    guideline_version: Mapped[int]
    inherited_from_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("reviews.id", ondelete="SET NULL")
    )
    created_at: Mapped[datetime] = mapped_column(default=now)
    replaced_at: Mapped[datetime | None]

    user: Mapped[User | None] = relationship(lazy="joined")

    __table_args__ = (
        sa.Index(
            "uq_reviews_current",
            "pose_id",
            "user_id",
            unique=True,
            sqlite_where=sa.text("replaced_at IS NULL"),
            postgresql_where=sa.text("replaced_at IS NULL"),
        ),
        sa.Index("ix_reviews_pose", "pose_id", "created_at"),
    )


class Correction(Base):
    """A pose as a person would have it, beside the generated one."""

    __tablename__ = "corrections"

    id: Mapped[int] = mapped_column(primary_key=True)
    pose_id: Mapped[int] = mapped_column(sa.ForeignKey("poses.id", ondelete="CASCADE"), index=True)
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    lat_deg: Mapped[float]
    lon_deg: Mapped[float]
    heading_deg: Mapped[float]
    length_m: Mapped[float]
    width_m: Mapped[float]
    height_m: Mapped[float]
    corners_in_image_px: Mapped[list[list[float]]] = mapped_column(Json)
    created_at: Mapped[datetime] = mapped_column(default=now)


class MissedVessel(Base):
    """A visible vessel without a pose: where it is in the image and why it was missed."""

    __tablename__ = "missed_vessels"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    x1_px: Mapped[float]
    y1_px: Mapped[float]
    x2_px: Mapped[float]
    y2_px: Mapped[float]
    reason: Mapped[MissedReason] = mapped_column(enum_type(MissedReason))
    created_at: Mapped[datetime] = mapped_column(default=now)


class ImageCompletion(Base):
    """A person's word that every visible vessel of an image in a run is accounted for."""

    __tablename__ = "image_completions"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_id: Mapped[int] = mapped_column(sa.ForeignKey("images.id", ondelete="CASCADE"))
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"))
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    created_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (sa.UniqueConstraint("image_id", "run_id"),)
