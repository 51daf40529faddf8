"""SQL of the map: what moved in a stretch of time, who it was, and when there is AIS at all."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import datetime
from operator import itemgetter
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute, Session

from app.ais.area import Area
from app.ais.moving_fixes import UNKNOWN
from app.ais.report_repository import Readable, visible, within
from app.domain.ais_bulk import AIS_CLASSES, SOURCES
from app.tables.ais import AisPosition, Vessel

AT_ONCE = 10_000
_ROWS_AT_ONCE = 100  # so many stay in a processor's cache until they are columns
MICROSECONDS_A_SECOND = sa.literal_column("1e6", sa.Float())


def seconds_since_1970(session: Session) -> sa.ColumnElement[float]:
    """Return the moment of a fix as the database itself can count it."""
    if session.get_bind().dialect.name == "sqlite":
        return sa.type_coerce(AisPosition.fix_time, sa.Float()) / MICROSECONDS_A_SECOND
    return sa.cast(sa.extract("epoch", AisPosition.fix_time), sa.Float())


def moving(
    session: Session,
    readable: Readable,
    start: datetime,
    end: datetime,
    area: Area | None,
    most: int,
) -> Iterator[Sequence[float]]:
    """Yield what the map draws of positions, rows of `moving_fixes.COLUMNS`, the oldest first.

    All are numbers, as the database gives them, times seconds since 1970: an object for each of a
    hundred thousand moments or names takes longer than all the rest. So do SQLAlchemy's own rows,
    which is why these come from the cursor.
    """
    wanted = _drawn(session, readable, *within(start, end, area))
    return _rows(session, wanted.order_by(AisPosition.hour, AisPosition.fix_time).limit(most))


def newest_id(session: Session) -> int:
    """Return the number that all positions of now are up to."""
    return session.scalar(sa.select(sa.func.max(AisPosition.id))) or 0


def arrived_after(
    session: Session, readable: Readable, after: int, most: int
) -> tuple[list[Sequence[float]], int, bool]:
    """Return what feeds brought after the position of a number, as `moving` does.

    Also the number of the last of them, and whether there are more than `most`. Feeds of a site
    write in turns, so that none of its positions gets a lower number later. Neither time nor place
    is asked for here: databases would go through the index of the last hour instead.
    """
    came = AisPosition.feed_id.is_not(None), AisPosition.id > after
    numbers = (
        sa.select(AisPosition.id)
        .where(visible(AisPosition.site_id, readable), *came)
        .order_by(AisPosition.id)
        .limit(most + 1)
    )
    found = session.scalars(numbers).all()
    if not found or len(found) > most:
        return [], found[-1] if found else after, bool(found)
    wanted = _drawn(session, readable, *came, AisPosition.id <= found[-1])
    return sorted(_rows(session, wanted), key=itemgetter(1)), found[-1], False


def _drawn(
    session: Session, readable: Readable, *conditions: sa.ColumnElement[bool]
) -> sa.Select[*tuple[Any, ...]]:
    return sa.select(
        AisPosition.mmsi,
        seconds_since_1970(session),
        AisPosition.lat_deg,
        AisPosition.lon_deg,
        sa.func.coalesce(AisPosition.sog_kn, UNKNOWN),
        sa.func.coalesce(AisPosition.cog_deg, UNKNOWN),
        sa.func.coalesce(AisPosition.heading_deg, UNKNOWN),
        _number_of(AisPosition.fix_time_source, SOURCES),
        _number_of(AisPosition.ais_class, AIS_CLASSES),
    ).where(visible(AisPosition.site_id, readable), *conditions)


def _rows(session: Session, statement: sa.Select[Any]) -> Iterator[Sequence[float]]:
    cursor = session.connection().execute(statement).cursor
    while cursor is not None and (rows := cursor.fetchmany(_ROWS_AT_ONCE)):
        yield from rows


def _number_of(
    column: InstrumentedAttribute[str] | InstrumentedAttribute[str | None],
    names: Sequence[str | None],
) -> sa.ColumnElement[int]:
    """Return a name's index in a list, 0 for what is not in it."""
    return sa.case(
        *((column == name, number) for number, name in enumerate(names) if number), else_=0
    )


def vessels(session: Session, mmsis: Collection[int]) -> Mapping[int, Vessel]:
    """Return what is known of some vessels."""
    found: dict[int, Vessel] = {}
    wanted = list(mmsis)
    for at in range(0, len(wanted), AT_ONCE):
        rows = session.scalars(sa.select(Vessel).where(Vessel.mmsi.in_(wanted[at : at + AT_ONCE])))
        found |= {vessel.mmsi: vessel for vessel in rows}
    return found


def span(session: Session, readable: Readable) -> tuple[datetime, datetime] | None:
    """Return the first and the last moment that a position is from; None without any."""
    times = sa.select(AisPosition.fix_time).where(visible(AisPosition.site_id, readable))
    earliest = AisPosition.hour, AisPosition.fix_time
    first = session.scalar(times.order_by(*earliest).limit(1))
    last = session.scalar(times.order_by(*(column.desc() for column in earliest)).limit(1))
    return None if first is None or last is None else (first, last)
