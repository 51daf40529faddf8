"""SQL of a vessel's page: its reports in parts, how many there are, and its statics."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.ais.report_repository import Readable, visible
from app.tables.ais import AisPosition, AisStatic


@dataclass(frozen=True, slots=True)
class ReportCounts:
    """How often a vessel was heard, and how often it said where its bow points."""

    positions: int
    with_heading: int
    first_at: datetime | None
    last_at: datetime | None

    @property
    def heading_share(self) -> float | None:
        """The share of reports with a heading; None without any report."""
        return self.with_heading / self.positions if self.positions else None


def counts(session: Session, readable: Readable, mmsi: int) -> ReportCounts:
    """Count a vessel's positions."""
    row = session.execute(
        sa.select(
            sa.func.count(AisPosition.id),
            sa.func.count(AisPosition.heading_deg),
            sa.func.min(AisPosition.fix_time),
            sa.func.max(AisPosition.fix_time),
        ).where(AisPosition.mmsi == mmsi, visible(AisPosition.site_id, readable))
    ).one()
    return ReportCounts(*row)


def positions_before(
    session: Session, readable: Readable, mmsi: int, before: datetime | None, count: int
) -> Sequence[AisPosition]:
    """Return a vessel's last positions before a moment (None: at all), newest first."""
    statement = sa.select(AisPosition).where(
        AisPosition.mmsi == mmsi, visible(AisPosition.site_id, readable)
    )
    if before is not None:
        statement = statement.where(AisPosition.fix_time < before)
    newest_first = statement.order_by(AisPosition.fix_time.desc(), AisPosition.id.desc())
    return session.scalars(newest_first.limit(count)).all()


def statics(session: Session, readable: Readable, mmsi: int, count: int) -> Sequence[AisStatic]:
    """Return a vessel's last static reports, oldest first."""
    newest_first = (
        sa.select(AisStatic)
        .where(AisStatic.mmsi == mmsi, visible(AisStatic.site_id, readable))
        .order_by(AisStatic.received_at.desc(), AisStatic.id.desc())
        .limit(count)
    )
    return list(reversed(session.scalars(newest_first).all()))
