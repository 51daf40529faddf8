"""Reading AIS reports in bulk, for tracks: as plain tuples, in the order of time.

Rows without a site are shared by all sites. `readable` is the set of sites that a caller may read,
None for all of them, as `Access.site_ids` gives it.
"""

from collections.abc import Collection, Iterable, Iterator
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute, Session

from app.ais.area import Area
from app.domain.cells import hour_of
from app.tables.ais import AisFile, AisPosition, AisStatic

Readable = frozenset[int] | None
_MOST_LOOKED_UP = 10_000  # cells of an hour; beyond it all of the hours are gone through
_VESSELS_AT_ONCE = 10_000  # SQLite takes some 32,000 values in a statement

POSITION_COLUMNS = (
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
    AisPosition.id,
    AisPosition.clock_suspect,
)
STATIC_COLUMNS = (
    AisStatic.mmsi,
    AisStatic.received_at,
    AisStatic.name,
    AisStatic.callsign,
    AisStatic.imo,
    AisStatic.ship_type,
    AisStatic.to_bow_m,
    AisStatic.to_stern_m,
    AisStatic.to_port_m,
    AisStatic.to_starboard_m,
    AisStatic.mothership_mmsi,
    AisStatic.id,
)


def visible(
    site_id: InstrumentedAttribute[int | None], readable: Readable
) -> sa.ColumnElement[bool]:
    """Return the condition that a row may be seen: shared or of a readable site, and whole.

    What an import is still writing is hidden, whoever asks.
    """
    if readable is None:
        return _whole(site_id)
    return sa.and_(sa.or_(site_id.is_(None), site_id.in_(readable)), _whole(site_id))


def _whole(site_id: InstrumentedAttribute[int | None]) -> sa.ColumnElement[bool]:
    """Hide files that are being written, few or none, and their reports."""
    if site_id.class_ is AisFile:
        return AisFile.is_whole == sa.true()
    file_id = AisStatic.file_id if site_id.class_ is AisStatic else AisPosition.file_id
    unfinished = sa.select(AisFile.id).where(~AisFile.is_whole).scalar_subquery()
    return sa.func.coalesce(file_id, 0).not_in(unfinished)


def within(
    start: datetime | None, end: datetime | None, area: Area | None
) -> list[sa.ColumnElement[bool]]:
    """Return the conditions on a position's time and place; none for what is not given."""
    conditions = during(start, end)
    cells = None if area is None else area.cells
    first = None if start is None else hour_of(start)
    last = None if end is None else hour_of(end)
    if cells and first is not None and last is not None:
        hours = range(first, last + 1)
        if len(hours) * len(cells) <= _MOST_LOOKED_UP:
            conditions.append(AisPosition.hour.in_(hours))
            first = last = None
    if first is not None:
        conditions.append(AisPosition.hour >= first)
    if last is not None:
        conditions.append(AisPosition.hour <= last)
    if cells is not None:
        conditions.append(AisPosition.cell.in_(cells))
    return conditions if area is None else conditions + _in_box(area)


def during(start: datetime | None, end: datetime | None) -> list[sa.ColumnElement[bool]]:
    """Return the conditions on a position's time alone, for what is looked up by its vessel."""
    conditions: list[sa.ColumnElement[bool]] = []
    if start is not None:
        conditions.append(AisPosition.fix_time >= start)
    if end is not None:
        conditions.append(AisPosition.fix_time <= end)
    return conditions


def _in_box(area: Area) -> list[sa.ColumnElement[bool]]:
    between = AisPosition.lon_deg >= area.west_deg, AisPosition.lon_deg <= area.east_deg
    return [
        AisPosition.lat_deg.between(area.south_deg, area.north_deg),
        sa.or_(*between) if area.crosses_antimeridian else sa.and_(*between),
    ]


def position_rows(
    session: Session, readable: Readable, start: datetime, end: datetime, area: Area | None
) -> Iterable[tuple[Any, ...]]:
    """Return `POSITION_COLUMNS` of all positions in a time window, oldest first."""
    statement = (
        sa.select(*POSITION_COLUMNS)
        .where(visible(AisPosition.site_id, readable), *within(start, end, area))
        .order_by(AisPosition.fix_time, AisPosition.id)
    )
    return (tuple(row) for row in session.execute(statement))


def suspect_rows(
    session: Session, readable: Readable, start: datetime, end: datetime, area: Area | None
) -> Iterable[tuple[Any, ...]]:
    """Return `POSITION_COLUMNS` and the arrival of what came in a time from a suspect receiver.

    Cells are not asked for: SQLite would go through all that was ever heard in them.
    """
    statement = (
        sa.select(*POSITION_COLUMNS, AisPosition.arrived_at)
        .where(
            AisPosition.clock_suspect == sa.true(),
            AisPosition.arrived_at.between(start, end),
            visible(AisPosition.site_id, readable),
            *([] if area is None else _in_box(area)),
        )
        .order_by(AisPosition.arrived_at, AisPosition.id)
    )
    return (tuple(row) for row in session.execute(statement))


def static_rows(
    session: Session,
    readable: Readable,
    vessels: Collection[int],
    start: datetime,
    end: datetime,
) -> Iterator[tuple[Any, ...]]:
    """Yield `STATIC_COLUMNS` of what vessels said in a time window, oldest first."""
    return _static_rows(session, readable, vessels, AisStatic.received_at.between(start, end))


def size_rows(
    session: Session,
    readable: Readable,
    vessels: Collection[int],
    start: datetime,
    end: datetime,
) -> Iterator[tuple[Any, ...]]:
    """Yield `STATIC_COLUMNS` of what vessels said of their size outside a time window."""
    return _static_rows(
        session,
        readable,
        vessels,
        sa.not_(AisStatic.received_at.between(start, end)),
        AisStatic.to_bow_m.is_not(None),
    )


def _static_rows(
    session: Session,
    readable: Readable,
    vessels: Collection[int],
    *conditions: sa.ColumnElement[bool],
) -> Iterator[tuple[Any, ...]]:
    ordered = sorted(vessels)
    for first in range(0, len(ordered), _VESSELS_AT_ONCE):
        some = ordered[first : first + _VESSELS_AT_ONCE]
        statement = (
            sa.select(*STATIC_COLUMNS)
            .where(visible(AisStatic.site_id, readable), AisStatic.mmsi.in_(some), *conditions)
            .order_by(AisStatic.received_at, AisStatic.id)
        )
        yield from (tuple(row) for row in session.execute(statement))
