"""Writing what comes live: few rows at a time, each stored unless the same fix is known already.

One statement for both databases, repeated row by row within one round trip. Two feeds of a site
often hear the same transmission in the same second, so their writers take turns on Postgres, site
by site; on SQLite every writer does.
"""

from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute, Session

from app.domain.ais import FixTimeSource
from app.tables.ais import AisPosition, AisStatic

_LIVE_LOCK = 0x4149_5302  # "AIS": any number of ours that no other lock has
# What says nothing new within this time is the same transmission heard again.
_REPEAT_WINDOW = timedelta(seconds=30)

_POSITION_COLUMNS = (
    AisPosition.site_id,
    AisPosition.feed_id,
    AisPosition.mmsi,
    AisPosition.fix_time,
    AisPosition.received_at,
    AisPosition.lat_deg,
    AisPosition.lon_deg,
    AisPosition.sog_kn,
    AisPosition.cog_deg,
    AisPosition.heading_deg,
    AisPosition.rot_deg_min,
    AisPosition.message_type,
    AisPosition.ais_class,
    AisPosition.high_accuracy,
    AisPosition.fix_time_source,
    AisPosition.arrived_at,
    AisPosition.clock_suspect,
    AisPosition.hour,
    AisPosition.cell,
)
_MOVES = (AisPosition.sog_kn, AisPosition.cog_deg, AisPosition.heading_deg)
_SAID = (
    AisStatic.name,
    AisStatic.callsign,
    AisStatic.imo,
    AisStatic.ship_type,
    AisStatic.to_bow_m,
    AisStatic.to_stern_m,
    AisStatic.to_port_m,
    AisStatic.to_starboard_m,
    AisStatic.mothership_mmsi,
)
_STATIC_COLUMNS = (
    AisStatic.site_id,
    AisStatic.feed_id,
    AisStatic.mmsi,
    AisStatic.received_at,
    AisStatic.arrived_at,
    *_SAID,
)
Columns = tuple[InstrumentedAttribute[Any], ...]


def take_turns(session: Session, site_id: int) -> None:
    """Wait until no other feed of this site is storing; until the end of the transaction."""
    if session.get_bind().dialect.name != "sqlite":
        session.execute(sa.select(sa.func.pg_advisory_xact_lock(_LIVE_LOCK, site_id)))


def add_positions(session: Session, rows: list[dict[str, Any]]) -> int:
    """Add positions, by column name; return how many fixes were not known.

    Where a message has no UTC second its fix is as old as its arrival, which differs from receiver
    to receiver; the same report within the window is the same transmission.
    """
    for row in rows:
        is_timed = row["fix_time_source"] != FixTimeSource.RECEIVED
        _add_window(row, row["fix_time"], timedelta() if is_timed else _REPEAT_WINDOW)
    known = sa.exists().where(
        AisPosition.mmsi == _given(AisPosition.mmsi),
        *_within_window(AisPosition.fix_time),
        sa.or_(
            AisPosition.fix_time == _given(AisPosition.fix_time),
            sa.and_(*(column.is_not_distinct_from(_given(column)) for column in _MOVES)),
        ),
        AisPosition.lat_deg == _given(AisPosition.lat_deg),
        AisPosition.lon_deg == _given(AisPosition.lon_deg),
        AisPosition.site_id == _given(AisPosition.site_id),
    )
    return _insert(session, AisPosition, _POSITION_COLUMNS, known, rows)


def add_statics(session: Session, rows: list[dict[str, Any]]) -> int:
    """Add static reports, by column name; return how many were no repeats."""
    for row in rows:
        _add_window(row, row["received_at"], _REPEAT_WINDOW)
    known = sa.exists().where(
        AisStatic.mmsi == _given(AisStatic.mmsi),
        *_within_window(AisStatic.received_at),
        AisStatic.site_id == _given(AisStatic.site_id),
        *(column.is_not_distinct_from(_given(column)) for column in _SAID),
    )
    return _insert(session, AisStatic, _STATIC_COLUMNS, known, rows)


def _add_window(row: dict[str, Any], moment: datetime, reach: timedelta) -> None:
    row["earliest"], row["latest"] = moment - reach, moment + reach


def _within_window(moment: InstrumentedAttribute[datetime]) -> Iterator[sa.ColumnElement[bool]]:
    yield moment >= sa.bindparam("earliest", type_=moment.type)
    yield moment <= sa.bindparam("latest", type_=moment.type)


def _insert(
    session: Session,
    table: type[AisPosition | AisStatic],
    columns: Columns,
    known: sa.Exists,
    rows: Iterable[dict[str, Any]],
) -> int:
    given = sa.select(*(_given(column) for column in columns)).where(~known)
    statement = sa.insert(table.__table__).from_select(  # type: ignore[arg-type]  # a mapped table
        [column.key for column in columns], given, include_defaults=False
    )
    parameters = list(rows)
    if not parameters:
        return 0
    # Past the ORM, which would ask for the keys of the new rows.
    result = session.connection().execute(
        statement, parameters, execution_options={"preserve_rowcount": True}
    )
    return result.rowcount


def _given(column: InstrumentedAttribute[Any]) -> sa.BindParameter[Any]:
    return sa.bindparam(column.key, type_=column.type)
