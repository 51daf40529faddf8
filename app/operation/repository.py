"""SQL of the running installation."""

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.operation import WorkerHeartbeat


def count_workers_seen(session: Session, *, since: datetime) -> int:
    """Count the workers whose heartbeat is younger than a moment."""
    statement = sa.select(sa.func.count()).where(WorkerHeartbeat.last_seen_at > since)
    return session.scalar(statement) or 0
