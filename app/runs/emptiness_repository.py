"""SQL that asks whether AIS was heard in the time of a run's images."""

from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.domain.cells import hour_of
from app.runs.recording_repository import AROUND
from app.tables.ais import AisFile, AisPosition
from app.tables.runs import Run, RunImage


class Span(NamedTuple):
    """The first and the last moment of something; None where there is nothing."""

    first_at: datetime | None
    last_at: datetime | None


def of_images(session: Session, run_id: int) -> Span:
    """Return when a run's first and last image were taken."""
    taken = RunImage.captured_at
    statement = sa.select(sa.func.min(taken), sa.func.max(taken)).where(RunImage.run_id == run_id)
    return Span(*session.execute(statement).one())


def of_recordings(session: Session, site_id: int) -> Span:
    """Return the first and the last report of all recordings a site may use."""
    statement = sa.select(sa.func.min(AisFile.first_at), sa.func.max(AisFile.last_at)).where(
        AisFile.is_whole, (AisFile.site_id == site_id) | AisFile.site_id.is_(None)
    )
    return Span(*session.execute(statement).one())


def was_heard(session: Session, run: Run, first_at: datetime, last_at: datetime) -> bool:
    """Whether any vessel was heard where a run's site listens, between two moments and around."""
    begin, end = first_at - AROUND, last_at + AROUND
    position = AisPosition
    statement = sa.select(
        sa.exists().where(
            position.hour.between(hour_of(begin), hour_of(end)),
            position.fix_time.between(begin, end),
            (position.site_id == run.site_id) | position.site_id.is_(None),
        )
    )
    return bool(session.scalar(statement))
