"""Runs of the pipeline and what they made: vessel states, matches, poses.

Runs stand side by side: a run never overwrites another's rows. `run_images` says which images are
done, one row an image, so that a run taken over by another worker adds nothing twice.
"""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.ais import WideId
from app.tables.deletion import Deletable, index_of_changed, index_of_deleted
from app.tables.detection import Detection, Model
from app.tables.imagery import Image
from app.tables.registration import Registration
from app.tables.sites import Viewport


class RunStatus(StrEnum):
    """Where a run stands."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


class Run(Deletable, Base):
    """One pass of the pipeline over a viewport's images, with all its parameters.

    `has_changed_images` says that times or viewports of its images were changed since.
    `changed_at` is when it was last deleted or brought back.
    """

    __tablename__ = "runs"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    viewport_id: Mapped[int] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="CASCADE"), index=True
    )
    registration_id: Mapped[int] = mapped_column(
        sa.ForeignKey("registrations.id", ondelete="RESTRICT")
    )
    model_id: Mapped[int] = mapped_column(sa.ForeignKey("models.id", ondelete="RESTRICT"))
    name: Mapped[str] = mapped_column(sa.String(200), default="")
    preset: Mapped[str] = mapped_column(sa.String(32))
    parameters: Mapped[dict[str, Any]]
    code_version: Mapped[str] = mapped_column(sa.String(64))
    status: Mapped[RunStatus] = mapped_column(enum_type(RunStatus), default=RunStatus.QUEUED)
    error: Mapped[str | None] = mapped_column(sa.Text)
    workflow_id: Mapped[str] = mapped_column(sa.String(64), unique=True)
    image_count: Mapped[int] = mapped_column(default=0)
    created_at: Mapped[datetime] = mapped_column(default=now)
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    has_changed_images: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    changed_at: Mapped[datetime | None]

    viewport: Mapped[Viewport] = relationship()
    registration: Mapped[Registration] = relationship()
    model: Mapped[Model] = relationship()

    __table_args__ = (index_of_deleted("runs"), index_of_changed("runs"))


class ReferenceRun(Base):
    """The run that the others of a site are measured by; `run_id` is None where it was taken back.

    The row stays, so that `version` tells every change.
    """

    __tablename__ = "reference_runs"

    site_id: Mapped[int] = mapped_column(
        sa.ForeignKey("sites.id", ondelete="CASCADE"), primary_key=True
    )
    run_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("runs.id", ondelete="SET NULL"), index=True
    )
    chosen_at: Mapped[datetime] = mapped_column(default=now)
    chosen_by_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    version: Mapped[int] = mapped_column(default=1)

    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class RunImage(Base):
    """An image of a run; `done_at` is set in the transaction that stores what came of it.

    `captured_at` is the time of the image that was used. `water_level_m` (ellipsoidal) is the level
    its vessels were put on, and where that came from (`WaterLevelSource`).
    """

    __tablename__ = "run_images"

    run_id: Mapped[int] = mapped_column(
        sa.ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True
    )
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    position: Mapped[int]
    detection_set_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("detection_sets.id", ondelete="SET NULL")
    )
    done_at: Mapped[datetime | None]
    captured_at: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(sa.Text)
    water_level_m: Mapped[float | None]
    water_level_source: Mapped[str | None] = mapped_column(sa.String(16))

    __table_args__ = (sa.Index("ix_run_images_position", "run_id", "position"),)


class VesselStateRow(Base):
    """A vessel's AIS state at the time of an image, and what became of it in the matching.

    `outcome` is `matched` or the reason why not. `report_ids` are the positions it was made from,
    by `track_method`, `static_ids` the static reports that told its size; the covariance is
    east-east, east-north, north-north (rows of old runs have neither it nor a sigma). `flags` say
    what to know before trusting it. `segments_px` holds the water-level plane segment as reported
    and dead-reckoned, 4 corners (u, v) each, empty where it
    has no projection.
    """

    __tablename__ = "vessel_states"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"))
    image_id: Mapped[int] = mapped_column(sa.ForeignKey("images.id", ondelete="CASCADE"))
    mmsi: Mapped[int]
    lat_deg: Mapped[float]
    lon_deg: Mapped[float]
    heading_deg: Mapped[float]
    heading_source: Mapped[str] = mapped_column(sa.String(32))
    speed_kn: Mapped[float]
    age_s: Mapped[float]
    to_bow_m: Mapped[float]
    to_stern_m: Mapped[float]
    to_port_m: Mapped[float]
    to_starboard_m: Mapped[float]
    report_ids: Mapped[list[int]]
    static_ids: Mapped[list[int]] = mapped_column(default=list, server_default=sa.text("'[]'"))
    track_method: Mapped[str | None] = mapped_column(sa.String(16))
    position_covariance_m2: Mapped[list[float] | None] = mapped_column(Json)
    heading_sigma_deg: Mapped[float | None]
    flags: Mapped[list[str]] = mapped_column(default=list, server_default=sa.text("'[]'"))
    outcome: Mapped[str] = mapped_column(sa.String(32))
    segments_px: Mapped[dict[str, Any]]

    __table_args__ = (sa.UniqueConstraint("run_id", "image_id", "mmsi"),)


class Match(Base):
    """A detection and a vessel state that belong together, at a cost made of named terms."""

    __tablename__ = "matches"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    detection_id: Mapped[int] = mapped_column(
        sa.ForeignKey("detections.id", ondelete="RESTRICT"), index=True
    )
    vessel_state_id: Mapped[int] = mapped_column(
        sa.ForeignKey("vessel_states.id", ondelete="CASCADE"), unique=True
    )
    cost: Mapped[float]
    cost_terms: Mapped[dict[str, Any]]

    detection: Mapped[Detection] = relationship(lazy="joined")
    vessel_state: Mapped[VesselStateRow] = relationship(lazy="joined")

    __table_args__ = (sa.UniqueConstraint("run_id", "detection_id"),)


class Pose(Base):
    """A generated 6D pose: never changed; people's verdicts and corrections stand beside it.

    Rotations are Rodrigues vectors; corners are in the order of `app/domain/README.md`. A
    `person_made` one was asked for by a person who saw which vessel an unmatched detection shows.
    Only flags may come later, at `changed_at`.
    """

    __tablename__ = "poses"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"))
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    match_id: Mapped[int] = mapped_column(
        sa.ForeignKey("matches.id", ondelete="CASCADE"), unique=True
    )
    mmsi: Mapped[int] = mapped_column(index=True)
    lat_deg: Mapped[float]
    lon_deg: Mapped[float]
    center_height_m: Mapped[float]
    heading_deg: Mapped[float]
    centroid_in_cam_m: Mapped[list[float]] = mapped_column(Json)
    rotvec_cam_from_vessel: Mapped[list[float]] = mapped_column(Json)
    length_m: Mapped[float]
    width_m: Mapped[float]
    height_m: Mapped[float]
    corners_in_image_px: Mapped[list[list[float]]] = mapped_column(Json)
    corrected_segment_px: Mapped[list[list[float]]] = mapped_column(Json)
    correction_in_enu_m: Mapped[list[float]] = mapped_column(Json)
    position_covariance_in_enu_m2: Mapped[list[list[float]] | None] = mapped_column(Json)
    heading_sigma_deg: Mapped[float | None]
    height_sigma_m: Mapped[float | None]
    flags: Mapped[list[str]]
    person_made: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    created_at: Mapped[datetime | None] = mapped_column(default=now, index=True)
    changed_at: Mapped[datetime | None]

    image: Mapped[Image] = relationship()
    match: Mapped[Match] = relationship(lazy="joined")
    run: Mapped[Run] = relationship()

    __table_args__ = (
        sa.UniqueConstraint("run_id", "image_id", "mmsi"),
        sa.Index("ix_poses_run_order", "run_id", "id"),
        index_of_changed("poses"),
    )


class RemovedPose(Base):
    """A pose that a run took back, kept for 30 days so that exports can tell that it is gone.

    Its id may be another pose's by now: SQLite gives the highest one out again.
    """

    __tablename__ = "removed_poses"

    id: Mapped[int] = mapped_column(primary_key=True)
    pose_id: Mapped[int] = mapped_column(WideId)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    person_made: Mapped[bool]
    removed_at: Mapped[datetime] = mapped_column(default=now, index=True)
