"""Rows as the driver gives them, because a million of anything else costs seconds."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

_NO_FRACTION = ".000000"


def driver_rows(session: Session, statement: sa.Select[Any]) -> Sequence[Any]:
    """Return the driver's own tuples, for columns that need no conversion."""
    found: Any = session.execute(statement)
    rows: Sequence[Any] = found.cursor.fetchall()
    return rows


def driver_parts(
    session: Session, statement: sa.Select[Any] | sa.CompoundSelect[Any], size: int
) -> Iterator[Sequence[Any]]:
    """Give rows so many at a time, on SQLite the driver's own tuples.

    Postgres would send all at once unless it is asked for parts, and then the first are
    SQLAlchemy's.
    """
    if session.get_bind().dialect.name != "sqlite":
        yield from session.execute(statement, execution_options={"yield_per": size}).partitions()
        return
    found: Any = session.execute(statement)
    with found:
        while rows := found.cursor.fetchmany(size):
            yield rows


def moment_text(stored: datetime | str) -> str:
    """Return a moment as a driver gives it, in UTC as ISO 8601 with Z; no fraction where it is 0.

    SQLite's is a text without a zone.
    """
    if isinstance(stored, str):
        return f"{stored[:10]}T{stored[11:].removesuffix(_NO_FRACTION)}Z"
    return f"{stored.astimezone(UTC).replace(tzinfo=None).isoformat()}Z"
