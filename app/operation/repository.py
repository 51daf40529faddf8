"""SQL of the running installation."""

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.operation import WorkerHeartbeat


def heartbeats(session: Session) -> list[tuple[str, datetime]]:
    """Return each worker's id and when it was last seen."""
    statement = sa.select(WorkerHeartbeat.executor_id, WorkerHeartbeat.last_seen_at)
    return [(worker, seen_at) for worker, seen_at in session.execute(statement)]


def database_bytes(session: Session) -> int:
    """Return how large the database is."""
    if session.get_bind().dialect.name == "sqlite":
        pages = session.scalar(sa.text("PRAGMA page_count")) or 0
        page_bytes = session.scalar(sa.text("PRAGMA page_size")) or 0
        return int(pages) * int(page_bytes)
    return session.scalar(sa.text("SELECT pg_database_size(current_database())")) or 0


def count_workers_seen(session: Session, *, since: datetime) -> int:
    """Count the workers whose heartbeat is younger than a moment."""
    statement = sa.select(sa.func.count()).where(WorkerHeartbeat.last_seen_at > since)
    return session.scalar(statement) or 0
