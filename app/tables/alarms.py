"""Alarms that administrators are told by mail: what is wrong, from when until when, and to whom."""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, enum_type, now

OPEN = sa.text("ended_at IS NULL")


class AlarmKind(StrEnum):
    """What an alarm is about."""

    SILENT_FEED = "silent_feed"
    SCARCE_DISK = "scarce_disk"


class Alarm(Base):
    """Something that is wrong until `ended_at`; at one time once of each thing.

    `subject` is the feed's id or the disk's folder, `path` the page to look at. `clear_since` says
    since when nothing is wrong any more, while it is watched whether that lasts.
    """

    __tablename__ = "alarms"

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[AlarmKind] = mapped_column(enum_type(AlarmKind))
    subject: Mapped[str] = mapped_column(sa.String(500))
    site_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True
    )
    title: Mapped[str] = mapped_column(sa.String(500))
    path: Mapped[str] = mapped_column(sa.String(200))
    begun_at: Mapped[datetime] = mapped_column(default=now)
    clear_since: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]

    __table_args__ = (
        sa.Index(
            "uq_alarms_kind_subject",
            "kind",
            "subject",
            unique=True,
            sqlite_where=OPEN,
            postgresql_where=OPEN,
        ),
    )


class AlarmLetter(Base):
    """One letter to one person: that an alarm began, or that it ended."""

    __tablename__ = "alarm_letters"

    id: Mapped[int] = mapped_column(primary_key=True)
    alarm_id: Mapped[int] = mapped_column(sa.ForeignKey("alarms.id", ondelete="CASCADE"))
    user_id: Mapped[int] = mapped_column(sa.ForeignKey("users.id", ondelete="CASCADE"), index=True)
    tells_end: Mapped[bool]

    alarm: Mapped[Alarm] = relationship()

    __table_args__ = (sa.UniqueConstraint("alarm_id", "user_id", "tells_end"),)
