"""SQL of alarms and their letters."""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.tables.alarms import Alarm, AlarmLetter


def open_alarms(session: Session) -> Sequence[Alarm]:
    """Return the alarms that have not ended."""
    return session.scalars(sa.select(Alarm).where(Alarm.ended_at.is_(None))).all()


def letter(session: Session, letter_id: int) -> AlarmLetter | None:
    """Return a letter with its alarm."""
    return find(session, AlarmLetter, letter_id, joinedload(AlarmLetter.alarm))
