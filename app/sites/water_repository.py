"""The SQL of water levels."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.water import WaterLevel

_AT_ONCE = 5000


def has_readings(session: Session, site_id: int) -> bool:
    """Whether a site has a series."""
    statement = sa.select(WaterLevel.id).where(WaterLevel.site_id == site_id).limit(1)
    return session.scalar(statement) is not None


def insert(session: Session, site_id: int, readings: Sequence[tuple[datetime, float]]) -> None:
    """Store the readings of a site that has none."""
    for begin in range(0, len(readings), _AT_ONCE):
        rows = [
            {"site_id": site_id, "measured_at": moment, "level_m": level_m}
            for moment, level_m in readings[begin : begin + _AT_ONCE]
        ]
        session.execute(sa.insert(WaterLevel), rows)


def readings(session: Session, site_id: int) -> list[tuple[datetime, float]]:
    """Return a site's readings in order of time."""
    rows = session.execute(
        sa.select(WaterLevel.measured_at, WaterLevel.level_m)
        .where(WaterLevel.site_id == site_id)
        .order_by(WaterLevel.measured_at)
    )
    return [(row[0], row[1]) for row in rows]


def readings_around(
    session: Session, site_id: int, first: datetime, last: datetime
) -> list[tuple[datetime, float]]:
    """Return a site's readings in order of time, from the last one until `first` to after `last`.

    Where there is none on one side they begin or end with what there is.
    """
    at = WaterLevel.measured_at
    own = WaterLevel.site_id == site_id
    before = sa.select(sa.func.max(at)).where(own, at <= first).scalar_subquery()
    after = sa.select(sa.func.min(at)).where(own, at >= last).scalar_subquery()
    rows = session.execute(
        sa.select(at, WaterLevel.level_m)
        .where(
            own,
            at >= sa.func.coalesce(before, sa.literal(first, at.type)),
            at <= sa.func.coalesce(after, sa.literal(last, at.type)),
        )
        .order_by(at)
    )
    return [(row[0], row[1]) for row in rows]
