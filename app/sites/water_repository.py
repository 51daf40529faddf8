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


def around(
    session: Session, site_id: int, moment: datetime
) -> tuple[tuple[datetime, float] | None, tuple[datetime, float] | None]:
    """Return a site's last reading until a moment, and its first one from it on."""
    own = sa.select(WaterLevel.measured_at, WaterLevel.level_m).where(WaterLevel.site_id == site_id)
    before = session.execute(
        own.where(WaterLevel.measured_at <= moment).order_by(WaterLevel.measured_at.desc()).limit(1)
    ).first()
    after = session.execute(
        own.where(WaterLevel.measured_at >= moment).order_by(WaterLevel.measured_at).limit(1)
    ).first()
    return (
        (before[0], before[1]) if before else None,
        (after[0], after[1]) if after else None,
    )
