"""Live feeds of AIS: what an operator set up, and apart from it what became of it.

The worker writes a feed's condition every second. It stands in a row of its own, so that neither
an edit nor its version ever collides with that.
"""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, enum_type, now
from app.tables.ais import WideId

IN_USE = sa.text("removed_at IS NULL")


class FeedKind(StrEnum):
    """How a feed's lines come."""

    TCP = "tcp"  # we connect to a receiver or a server that sends lines
    UDP = "udp"  # receivers send datagrams to us


class FeedCondition(StrEnum):
    """How the link of a feed stands, as its worker last knew."""

    WAITING = "waiting"  # not connected; tried again and again
    CONNECTED = "connected"  # a connection is open, or the port is listened on
    REFUSED = "refused"  # the address is one that feeds may not use


class AisFeed(Base):
    """A feed of one site. `host` is where to connect to (TCP) or the address to listen on (UDP).

    A removed feed keeps its row, because its reports say that they came from it.
    """

    __tablename__ = "ais_feeds"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(sa.String(200))
    kind: Mapped[FeedKind] = mapped_column(enum_type(FeedKind))
    host: Mapped[str] = mapped_column(sa.String(255))
    port: Mapped[int]
    allowed_senders: Mapped[list[str]] = mapped_column(default=list)
    silent_after_s: Mapped[float]
    enabled: Mapped[bool] = mapped_column(default=True)
    started_at: Mapped[datetime] = mapped_column(default=now)
    removed_at: Mapped[datetime | None]
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    version: Mapped[int] = mapped_column(default=1)

    __table_args__ = (
        sa.Index(
            "uq_ais_feeds_site_id_name",
            "site_id",
            "name",
            unique=True,
            sqlite_where=IN_USE,
            postgresql_where=IN_USE,
        ),
    )
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class AisFeedStatus(Base):
    """What the worker that holds a feed last wrote of it, together with the reports it brought."""

    __tablename__ = "ais_feed_statuses"

    feed_id: Mapped[int] = mapped_column(
        sa.ForeignKey("ais_feeds.id", ondelete="CASCADE"), primary_key=True, autoincrement=False
    )
    condition: Mapped[FeedCondition] = mapped_column(
        enum_type(FeedCondition), default=FeedCondition.WAITING
    )
    condition_since: Mapped[datetime] = mapped_column(default=now)
    peer: Mapped[str | None] = mapped_column(sa.String(64))
    connections: Mapped[int] = mapped_column(default=0)
    last_message_at: Mapped[datetime | None]
    rate_per_s: Mapped[float] = mapped_column(default=0.0)
    receiver_lag_s: Mapped[float | None]
    foreign_datagrams: Mapped[int] = mapped_column(WideId, default=0)
    last_error: Mapped[str | None] = mapped_column(sa.String(500))
    last_error_at: Mapped[datetime | None]
    accounting: Mapped[dict[str, Any]]
    written_at: Mapped[datetime] = mapped_column(default=now)
