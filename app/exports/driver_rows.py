"""Rows as the driver gives them, because a million of anything else costs seconds."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session


def driver_rows(session: Session, statement: sa.Select[Any]) -> Sequence[Any]:
    """Return the driver's own tuples, for columns that need no conversion."""
    found: Any = session.execute(statement)
    rows: Sequence[Any] = found.cursor.fetchall()
    return rows


def as_moment(stored: datetime | str) -> datetime:
    """Return a moment as a driver gives it, in UTC: SQLite's is a text without a zone."""
    if isinstance(stored, str):
        return datetime.fromisoformat(stored).replace(tzinfo=UTC)
    return stored.astimezone(UTC)
