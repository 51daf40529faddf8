"""Rows as the driver gives them, because a million of anything else costs seconds."""

from collections.abc import Iterator, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session


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
