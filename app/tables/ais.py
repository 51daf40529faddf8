"""AIS: files with their accounting, position and static reports, the vessels they speak of.

A file belongs to one site, or to all of them when `site_id` is empty: a receiver often covers more
than one camera. A report came from a file or from a live feed.
"""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.engine.default import DefaultExecutionContext
from sqlalchemy.orm import Mapped, mapped_column

from app.db import ONLY_ON, Base, Json, UtcMicroseconds, now
from app.domain.cells import cell_of, hour_of
from app.tables.deletion import Deletable, index_of_deleted

_PRESENT = sa.text("deleted_at IS NULL")
_IMPORTING = sa.text("NOT is_whole")
WideId = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def _of_feeds(name: str) -> sa.Index:
    """Return an index of what came live, which costs the reports of files nothing."""
    live = sa.text("feed_id IS NOT NULL")
    return sa.Index(name, "feed_id", sqlite_where=live, postgresql_where=live)


_SUSPECT_SQLITE = sa.text("clock_suspect = 1")
_SUSPECT_POSTGRES = sa.text("clock_suspect")


def _cell(context: DefaultExecutionContext) -> int:
    """Return the cell of a position that is being stored."""
    row = context.get_current_parameters()  # type: ignore[no-untyped-call]  # SQLAlchemy has no type for it
    return cell_of(row["lat_deg"], row["lon_deg"])


def _hour(context: DefaultExecutionContext) -> int:
    """Return the hour of a position that is being stored."""
    return hour_of(context.get_current_parameters()["fix_time"])  # type: ignore[no-untyped-call]  # as above


class AisFile(Deletable, Base):
    """One imported recording, known by its content, with what became of every line.

    A deleted one hides all its reports, and its content may come again meanwhile.

    `mapping` is what somebody said of its table's columns. Until `is_whole` its rows are being
    written, and nobody sees them.
    """

    __tablename__ = "ais_files"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True
    )
    sha256: Mapped[str] = mapped_column(sa.String(64))
    file_name: Mapped[str] = mapped_column(sa.String(255))
    format: Mapped[str] = mapped_column(sa.String(32))
    size_bytes: Mapped[int]
    accounting: Mapped[dict[str, Any]]
    mapping: Mapped[dict[str, Any] | None] = mapped_column(Json)
    is_whole: Mapped[bool] = mapped_column(default=True, server_default=sa.true())
    first_at: Mapped[datetime | None]
    last_at: Mapped[datetime | None]
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )

    __table_args__ = (
        sa.Index(
            "uq_ais_files_content",
            "sha256",
            sa.text("coalesce(site_id, 0)"),
            unique=True,
            sqlite_where=_PRESENT,
            postgresql_where=_PRESENT,
        ),
        index_of_deleted("ais_files"),
        sa.Index(
            "ix_ais_files_importing", "id", sqlite_where=_IMPORTING, postgresql_where=_IMPORTING
        ),
    )


class AisPosition(Base):
    """A position report (ITU-R M.1371 types 1, 2, 3, 18, 19); empty where not available.

    `received_at` is the receiver's word. Of what came live also `arrived_at` is kept, by our own
    clock; where the two cannot both be true (`clock_suspect`) no image uses the report.
    """

    __tablename__ = "ais_positions"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    site_id: Mapped[int | None] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"))
    file_id: Mapped[int | None] = mapped_column(index=True)
    feed_id: Mapped[int | None] = mapped_column(sa.ForeignKey("ais_feeds.id", ondelete="CASCADE"))
    mmsi: Mapped[int]
    fix_time: Mapped[datetime] = mapped_column(UtcMicroseconds)
    received_at: Mapped[datetime] = mapped_column(UtcMicroseconds)
    lat_deg: Mapped[float]
    lon_deg: Mapped[float]
    sog_kn: Mapped[float | None]
    cog_deg: Mapped[float | None]
    heading_deg: Mapped[float | None]
    rot_deg_min: Mapped[float | None]
    message_type: Mapped[int | None]
    ais_class: Mapped[str | None] = mapped_column(sa.String(1))
    high_accuracy: Mapped[bool | None]
    fix_time_source: Mapped[str] = mapped_column(sa.String(16), default="prompt")
    arrived_at: Mapped[datetime | None] = mapped_column(UtcMicroseconds)
    clock_suspect: Mapped[bool | None]
    hour: Mapped[int] = mapped_column(default=_hour)
    cell: Mapped[int] = mapped_column(default=_cell)

    __table_args__ = (
        # Postgres would look up the file of each row that is imported, which takes it a third of
        # the time. A recording's rows are removed before it is, and nothing else removes one.
        sa.ForeignKeyConstraint(
            ["file_id"], ["ais_files.id"], ondelete="CASCADE", info={ONLY_ON: "sqlite"}
        ),
        sa.Index("ix_ais_positions_vessel_time", "mmsi", "fix_time"),
        sa.Index("ix_ais_positions_hour_cell_time", "hour", "cell", "fix_time"),
        _of_feeds("ix_ais_positions_feed_id"),
        sa.Index(
            "ix_ais_positions_suspect_arrival",
            "arrived_at",
            sqlite_where=_SUSPECT_SQLITE,
            postgresql_where=_SUSPECT_POSTGRES,
        ),
    )


class AisStatic(Base):
    """A static report (types 5, 19, 24 or a table's columns); empty where not said."""

    __tablename__ = "ais_statics"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    site_id: Mapped[int | None] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"))
    file_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("ais_files.id", ondelete="CASCADE"), index=True
    )
    feed_id: Mapped[int | None] = mapped_column(sa.ForeignKey("ais_feeds.id", ondelete="CASCADE"))
    mmsi: Mapped[int]
    received_at: Mapped[datetime]
    name: Mapped[str | None] = mapped_column(sa.String(64))
    callsign: Mapped[str | None] = mapped_column(sa.String(16))
    imo: Mapped[int | None]
    ship_type: Mapped[int | None]
    to_bow_m: Mapped[float | None]
    to_stern_m: Mapped[float | None]
    to_port_m: Mapped[float | None]
    to_starboard_m: Mapped[float | None]
    mothership_mmsi: Mapped[int | None]
    arrived_at: Mapped[datetime | None]

    __table_args__ = (
        sa.Index("ix_ais_statics_vessel_time", "mmsi", "received_at"),
        _of_feeds("ix_ais_statics_feed_id"),
    )


class Vessel(Base):
    """A vessel as last heard of; its reports stay in the tables above."""

    __tablename__ = "vessels"

    mmsi: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str | None] = mapped_column(sa.String(64))
    callsign: Mapped[str | None] = mapped_column(sa.String(16))
    imo: Mapped[int | None]
    ship_type: Mapped[int | None]
    length_m: Mapped[float | None]
    width_m: Mapped[float | None]
    first_seen_at: Mapped[datetime]
    last_seen_at: Mapped[datetime]
