"""What goes on by itself: watched folders, standing runs, and rules for what is kept."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, enum_type, now
from app.tables.deletion import DeletableAlone, index_of_deleted, unique_among_present
from app.tables.detection import Model
from app.tables.sites import Camera, Viewport


class WatchedFolder(DeletableAlone, Base):
    """A folder, seen by the workers, whose photographs are a camera's."""

    __tablename__ = "watched_folders"

    id: Mapped[int] = mapped_column(primary_key=True)
    camera_id: Mapped[int] = mapped_column(
        sa.ForeignKey("cameras.id", ondelete="CASCADE"), index=True
    )
    path: Mapped[str] = mapped_column(sa.String(1000))
    moves_files: Mapped[bool] = mapped_column(default=False)
    paused_at: Mapped[datetime | None]
    looked_at: Mapped[datetime | None]
    trouble: Mapped[str | None] = mapped_column(sa.Text)
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    camera: Mapped[Camera] = relationship()

    __table_args__ = (
        unique_among_present("watched_folders", "camera_id", "path"),
        index_of_deleted("watched_folders"),
    )
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class WatchedFileStatus(StrEnum):
    """What became of a file in a watched folder."""

    WAITING = "waiting"  # until it stops growing
    TAKEN = "taken"
    KNOWN = "known"
    REFUSED = "refused"


class WatchedFile(Base):
    """A file of a watched folder, as it was when last looked at."""

    __tablename__ = "watched_files"

    id: Mapped[int] = mapped_column(primary_key=True)
    folder_id: Mapped[int] = mapped_column(sa.ForeignKey("watched_folders.id", ondelete="CASCADE"))
    path: Mapped[str] = mapped_column(sa.String(1000))
    size_bytes: Mapped[int] = mapped_column(sa.BigInteger)
    modified_ns: Mapped[int] = mapped_column(sa.BigInteger)
    status: Mapped[WatchedFileStatus] = mapped_column(enum_type(WatchedFileStatus))
    reason: Mapped[str | None] = mapped_column(sa.Text)
    seen_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (sa.UniqueConstraint("folder_id", "path"),)


class StandingRun(DeletableAlone, Base):
    """What is done with a viewport's images as they come, and again when AIS comes later.

    Images younger than `ais_wait_s` are fused again when reports of their time come in;
    `last_report_id` is the newest report that was seen to. `run_id` is the run that grows; a new
    registration begins another one.
    """

    __tablename__ = "standing_runs"

    id: Mapped[int] = mapped_column(primary_key=True)
    viewport_id: Mapped[int] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="CASCADE"), index=True
    )
    model_id: Mapped[int] = mapped_column(sa.ForeignKey("models.id", ondelete="RESTRICT"))
    run_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("runs.id", ondelete="SET NULL"), unique=True
    )
    name: Mapped[str] = mapped_column(sa.String(200))
    preset: Mapped[str] = mapped_column(sa.String(32))
    parameters: Mapped[dict[str, Any]]
    ais_wait_s: Mapped[float]
    paused_at: Mapped[datetime | None]
    looked_at: Mapped[datetime | None]
    trouble: Mapped[str | None] = mapped_column(sa.Text)
    last_report_id: Mapped[int] = mapped_column(sa.BigInteger, default=0)
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    version: Mapped[int] = mapped_column(default=1)

    viewport: Mapped[Viewport] = relationship()
    model: Mapped[Model] = relationship()

    __table_args__ = (index_of_deleted("standing_runs"),)
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class RetentionKind(StrEnum):
    """What a rule is about."""

    IMAGES = "images"  # that nobody has judged, corrected or exported
    AIS_POSITIONS = "ais_positions"  # that no pose rests on
    PREVIEWS = "previews"


class RetentionRule(DeletableAlone, Base):
    """How many days something of a site, or of one camera of it, is kept."""

    __tablename__ = "retention_rules"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    camera_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("cameras.id", ondelete="CASCADE"), index=True
    )
    kind: Mapped[RetentionKind] = mapped_column(enum_type(RetentionKind))
    keep_days: Mapped[int]
    takes_judged: Mapped[bool] = mapped_column(default=False)
    is_active: Mapped[bool] = mapped_column(default=False)
    applied_at: Mapped[datetime | None]
    applied_count: Mapped[int | None]
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    __table_args__ = (index_of_deleted("retention_rules"),)
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way
