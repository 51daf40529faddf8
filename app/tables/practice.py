"""Calibration sets: poses somebody has judged with care, for newcomers to practise on.

What people answer here is no review and stands in no figure about a run. A person may go through a
set again; each going through is an attempt of its own, so that learning can be seen.
"""

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, enum_type, now
from app.tables.ais import WideId
from app.tables.deletion import DeletableAlone, index_of_deleted
from app.tables.reviews import Grade
from app.tables.runs import Run


class CalibrationSet(DeletableAlone, Base):
    """Judged poses of one run. `seed`: of the draw, where they were judged from the truth."""

    __tablename__ = "calibration_sets"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(sa.String(200))
    from_truth: Mapped[bool]
    seed: Mapped[int | None]
    guideline_version: Mapped[int]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    created_at: Mapped[datetime] = mapped_column(default=now)

    run: Mapped[Run] = relationship()

    __table_args__ = (index_of_deleted("calibration_sets"),)


class JudgedPose(Base):
    """A pose of a set with the grade it deserves, and why."""

    __tablename__ = "judged_poses"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    set_id: Mapped[int] = mapped_column(sa.ForeignKey("calibration_sets.id", ondelete="CASCADE"))
    pose_id: Mapped[int] = mapped_column(sa.ForeignKey("poses.id", ondelete="CASCADE"), index=True)
    position: Mapped[int]
    grade: Mapped[Grade] = mapped_column(enum_type(Grade))
    reasons: Mapped[list[str]]
    note: Mapped[str] = mapped_column(sa.Text)

    __table_args__ = (sa.UniqueConstraint("set_id", "pose_id"),)


class PracticeAttempt(Base):
    """A person's going through a set, numbered from 1."""

    __tablename__ = "practice_attempts"

    id: Mapped[int] = mapped_column(primary_key=True)
    set_id: Mapped[int] = mapped_column(sa.ForeignKey("calibration_sets.id", ondelete="CASCADE"))
    user_id: Mapped[int] = mapped_column(sa.ForeignKey("users.id", ondelete="CASCADE"), index=True)
    number: Mapped[int]
    started_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (sa.UniqueConstraint("set_id", "user_id", "number"),)


class PracticeGrade(Base):
    """A person's grade of a judged pose in an attempt: the first, which alone was blind."""

    __tablename__ = "practice_grades"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    attempt_id: Mapped[int] = mapped_column(
        sa.ForeignKey("practice_attempts.id", ondelete="CASCADE")
    )
    pose_id: Mapped[int] = mapped_column(sa.ForeignKey("poses.id", ondelete="CASCADE"), index=True)
    grade: Mapped[Grade] = mapped_column(enum_type(Grade))
    reasons: Mapped[list[str]]
    seconds: Mapped[float | None]
    created_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (sa.UniqueConstraint("attempt_id", "pose_id"),)
