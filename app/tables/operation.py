"""Which workers live, what each of them holds, and how often a job was taken over."""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, enum_type, now


class WorkerHeartbeat(Base):
    """A worker process; stale when `last_seen_at` is old."""

    __tablename__ = "worker_heartbeats"

    executor_id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    host: Mapped[str] = mapped_column(sa.String(255))
    pid: Mapped[int]
    code_version: Mapped[str] = mapped_column(sa.String(64))
    started_at: Mapped[datetime] = mapped_column(default=now)
    last_seen_at: Mapped[datetime] = mapped_column(default=now, index=True)


class FileProblem(StrEnum):
    """What is wrong with a stored file."""

    MISSING = "missing"
    DAMAGED = "damaged"


class FileFinding(Base):
    """A file of the store that a check found missing or changed; gone once it is whole again."""

    __tablename__ = "file_findings"

    sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    problem: Mapped[FileProblem] = mapped_column(enum_type(FileProblem))
    found_at: Mapped[datetime] = mapped_column(default=now)


class Takeover(Base):
    """How many times a job lost its worker; after too many it fails with a reason."""

    __tablename__ = "takeovers"

    workflow_id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    attempts: Mapped[int] = mapped_column(default=0)
    last_at: Mapped[datetime] = mapped_column(default=now)


class Lease(Base):
    """Which worker does something that only one may do at a time, such as listening to a feed.

    `epoch` grows with every change of hands: whoever writes under an old one is refused.
    """

    __tablename__ = "leases"

    name: Mapped[str] = mapped_column(sa.String(128), primary_key=True)
    holder: Mapped[str | None] = mapped_column(sa.String(64))
    epoch: Mapped[int] = mapped_column(sa.BigInteger)
    taken_at: Mapped[datetime]
    renewed_at: Mapped[datetime]
