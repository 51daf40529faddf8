"""Rows back into an empty database, in whatever form it stores them."""

import sqlite3
from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any

import psycopg
import sqlalchemy as sa
from psycopg import sql

from app.domain.nmea_times import epoch_us
from app.errors import Invalid
from app.keeping.archive import TableEntry
from app.keeping.snapshot import COUNTED, MOMENT

LENGTH_WITHOUT_ZONE = len("2026-11-22 10:00:05.000000")


def load(connection: sa.Connection, table: TableEntry, rows: Iterator[Sequence[Any]]) -> int:
    """Insert a table's rows; returns how many."""
    raw = connection.connection.driver_connection
    if isinstance(raw, sqlite3.Connection):
        return _load_sqlite(raw, table, rows)
    if isinstance(raw, psycopg.Connection):
        return _load_postgres(raw, table, rows)
    raise TypeError(f"no way to load rows by {type(raw).__name__}")


def check_references(connection: sa.Connection) -> None:
    """Raise Invalid when a row refers to one that is not there.

    SQLite was told not to look while tables were made; Postgres looks at every statement.
    """
    if connection.dialect.name != "sqlite":
        return
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
    if broken is not None:
        raise Invalid(f"a row of {broken[0]} refers to a row of {broken[2]} that is not there")


def continue_numbering(connection: sa.Connection, tables: Sequence[TableEntry]) -> None:
    """Let Postgres number new rows after the loaded ones; SQLite does so by itself."""
    if connection.dialect.name == "sqlite":
        return
    for table in tables:
        if "id" in table.columns:
            rows = sa.table(table.name, sa.column("id"))
            highest = sa.select(sa.func.max(rows.c.id)).scalar_subquery()
            sequence = sa.func.pg_get_serial_sequence(table.name, "id")
            connection.execute(
                sa.select(
                    sa.func.setval(sequence, sa.func.coalesce(highest, 1), highest.is_not(None))
                ).where(sequence.is_not(None))
            )


def _load_sqlite(raw: sqlite3.Connection, table: TableEntry, rows: Iterator[Sequence[Any]]) -> int:
    kinds = list(enumerate(table.columns.values()))
    moments = [at for at, kind in kinds if kind == MOMENT]
    counted = [at for at, kind in kinds if kind == COUNTED]
    columns = ", ".join(f'"{name}"' for name in table.columns)
    marks = ", ".join("?" * len(table.columns))
    # Names are those of our own tables, checked when the archive was opened.
    statement = f'INSERT INTO "{table.name}" ({columns}) VALUES ({marks})'  # noqa: S608
    before = raw.total_changes
    raw.executemany(statement, (_as_kept(row, moments, counted) for row in rows))
    return raw.total_changes - before


def _as_kept(row: Sequence[Any], moments: Sequence[int], counted: Sequence[int]) -> list[Any]:
    """Return a row as SQLite keeps it: it knows no zones, and all of ours are UTC."""
    values = list(row)
    for at in moments:
        if values[at] is not None:
            values[at] = values[at][:LENGTH_WITHOUT_ZONE]
    for at in counted:
        if values[at] is not None:
            values[at] = epoch_us(datetime.fromisoformat(values[at]))
    return values


def _load_postgres(
    raw: "psycopg.Connection[Any]", table: TableEntry, rows: Iterator[Sequence[Any]]
) -> int:
    statement = sql.SQL("COPY {} ({}) FROM STDIN").format(
        sql.Identifier(table.name), sql.SQL(", ").join(map(sql.Identifier, table.columns))
    )
    count = 0
    with raw.cursor() as cursor, cursor.copy(statement) as copy:
        for row in rows:
            copy.write_row(row)
            count += 1
    return count
