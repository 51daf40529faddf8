"""What people say of poses and images: verdicts, corrections, vessels nobody found."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.deletion import DeletableAlone, index_of_deleted
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
    """A person's verdict on a pose. A later one by the same person replaces it; both are kept.

    `decision` is the name the person's program gave it, so that it can be spoken of before its id
    is known; grades given in one stroke share it. `second_opinion`: another person's verdict stood
    already when it came. `settles`: given to end a disagreement. A review that is replaced or
    withdrawn has `replaced_at`. `words_at` is when its reasons or comment last changed.
    """

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
    decision: Mapped[str | None] = mapped_column(sa.String(200))
    second_opinion: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    settles: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    created_at: Mapped[datetime] = mapped_column(default=now)
    replaced_at: Mapped[datetime | None]
    withdrawn_at: Mapped[datetime | None]
    words_at: Mapped[datetime | None]

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
        sa.Index("ix_reviews_decision", "user_id", "decision"),
        sa.Index("ix_reviews_created_at", "created_at"),
        sa.Index(
            "ix_reviews_replaced_at",
            "replaced_at",
            sqlite_where=sa.text("replaced_at IS NOT NULL"),
            postgresql_where=sa.text("replaced_at IS NOT NULL"),
        ),
        sa.Index(
            "ix_reviews_words_at",
            "words_at",
            sqlite_where=sa.text("words_at IS NOT NULL"),
            postgresql_where=sa.text("words_at IS NOT NULL"),
        ),
    )


def verdict_order() -> tuple[sa.ColumnElement[Any], ...]:
    """Order standing reviews so that the one whose grade counts for the pose comes first.

    A second opinion does not overrule the verdict it disagrees with; among equals the newest does.
    """
    return (Review.second_opinion.asc(), Review.id.desc())


class CorrectionKind(StrEnum):
    """What a person did to a pose."""

    EDITED = "edited"  # moved, turned or resized the box
    REMATCHED = "rematched"  # chose another vessel; the box was computed anew for it


class Correction(Base):
    """A pose as a person would have it, beside the generated one, which is never changed.

    Versions count up from 1 for each pose; the newest counts unless it is deleted. `mmsi` is the
    vessel it is of, which a re-match makes another one than the pose's.
    """

    __tablename__ = "corrections"

    id: Mapped[int] = mapped_column(primary_key=True)
    pose_id: Mapped[int] = mapped_column(sa.ForeignKey("poses.id", ondelete="CASCADE"))
    version: Mapped[int]
    kind: Mapped[CorrectionKind] = mapped_column(enum_type(CorrectionKind))
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    mmsi: Mapped[int]
    vessel_state_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("vessel_states.id", ondelete="SET NULL")
    )
    lat_deg: Mapped[float]
    lon_deg: Mapped[float]
    base_height_m: Mapped[float]
    center_height_m: Mapped[float]
    heading_deg: Mapped[float]
    length_m: Mapped[float]
    width_m: Mapped[float]
    height_m: Mapped[float]
    centroid_in_cam_m: Mapped[list[float]] = mapped_column(Json)
    rotvec_cam_from_vessel: Mapped[list[float]] = mapped_column(Json)
    corners_in_image_px: Mapped[list[list[float] | None]] = mapped_column(Json)
    cost: Mapped[float | None]
    cost_terms: Mapped[dict[str, Any] | None] = mapped_column(Json)
    flags: Mapped[list[str]] = mapped_column(default=list)
    comment: Mapped[str | None] = mapped_column(sa.Text)
    created_at: Mapped[datetime] = mapped_column(default=now)
    deleted_at: Mapped[datetime | None]

    user: Mapped[User | None] = relationship(lazy="joined")

    __table_args__ = (
        sa.UniqueConstraint("pose_id", "version"),
        sa.Index("ix_corrections_created_at", "created_at"),
        sa.Index(
            "ix_corrections_deleted_at",
            "deleted_at",
            sqlite_where=sa.text("deleted_at IS NOT NULL"),
            postgresql_where=sa.text("deleted_at IS NOT NULL"),
        ),
    )


class MissedVessel(DeletableAlone, Base):
    """A visible vessel without a pose: where it is in the image and why it was missed."""

    __tablename__ = "missed_vessels"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    x1_px: Mapped[float]
    y1_px: Mapped[float]
    x2_px: Mapped[float]
    y2_px: Mapped[float]
    reason: Mapped[MissedReason] = mapped_column(enum_type(MissedReason))
    comment: Mapped[str | None] = mapped_column(sa.Text)
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    user: Mapped[User | None] = relationship(lazy="joined")

    __table_args__ = (index_of_deleted("missed_vessels"),)
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class ImageCompletion(Base):
    """A person's word that every visible vessel of an image in a run is accounted for."""

    __tablename__ = "image_completions"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_id: Mapped[int] = mapped_column(sa.ForeignKey("images.id", ondelete="CASCADE"))
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"))
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    created_at: Mapped[datetime] = mapped_column(default=now)

    user: Mapped[User | None] = relationship(lazy="joined")

    __table_args__ = (
        sa.UniqueConstraint("image_id", "run_id"),
        sa.Index("ix_image_completions_run_id", "run_id"),
    )
