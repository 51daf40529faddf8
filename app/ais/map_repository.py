"""SQL of the map: what moved in a stretch of time, who it was, and when there is AIS at all."""

from collections.abc import Collection, Iterable, Mapping
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.report_repository import Readable, visible, within
from app.tables.ais import AisPosition, Vessel

AT_ONCE = 10_000
JULIAN_DAY_OF_1970 = 2_440_587.5
SECONDS_A_DAY = 86_400.0
Moving = tuple[int, float, float, float, float | None, float | None, float | None, str, str | None]


def seconds_since_1970(session: Session) -> sa.ColumnElement[float]:
    """Return the moment of a fix as the database itself can count it."""
    if session.get_bind().dialect.name == "sqlite":
        days = sa.func.julianday(AisPosition.fix_time, type_=sa.Float()) - JULIAN_DAY_OF_1970
        return days * SECONDS_A_DAY
    return sa.cast(sa.extract("epoch", AisPosition.fix_time), sa.Float())


def moving(
    session: Session,
    readable: Readable,
    start: datetime,
    end: datetime,
    area: Area | None,
    most: int,
) -> Iterable[Moving]:
    """Return what the map draws of positions, oldest first: MMSI, time, place, motion, class.

    Times are seconds since 1970, as the database gives them: a moment's object for each of a
    hundred thousand rows takes longer than all the rest.
    """
    statement = (
        sa.select(
            AisPosition.mmsi,
            seconds_since_1970(session),
            AisPosition.lat_deg,
            AisPosition.lon_deg,
            AisPosition.sog_kn,
            AisPosition.cog_deg,
            AisPosition.heading_deg,
            AisPosition.fix_time_source,
            AisPosition.ais_class,
        )
        .where(visible(AisPosition.site_id, readable), *within(start, end, area))
        .order_by(AisPosition.fix_time)
        .limit(most)
    )
    return session.execute(statement.execution_options(yield_per=AT_ONCE))


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
    first = session.scalar(times.order_by(AisPosition.fix_time).limit(1))
    last = session.scalar(times.order_by(AisPosition.fix_time.desc()).limit(1))
    return None if first is None or last is None else (first, last)
