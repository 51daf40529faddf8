"""All rows of all tables as they stood at one moment, while others go on writing.

On SQLite a reading transaction sees the write-ahead log up to its first statement; on Postgres a
REPEATABLE READ one sees what was committed by then. Either way writers wait for nobody. Each value
is written in a form both databases understand: moments as text in UTC, JSON as its text, bytes in
base 64.
"""

import gzip
import json
from base64 import b64decode, b64encode
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from app.db import Base, Database, UtcDateTime, UtcMicroseconds
from app.keeping.archive import TableEntry, sha256_of
from app.tables.operation import Takeover, WorkerHeartbeat

# What is only true of processes that run now.
OF_THE_MOMENT = frozenset({Takeover.__tablename__, WorkerHeartbeat.__tablename__})
ROWS_AT_A_TIME = 2000
QUICK = 1  # gzip: three quarters of the gain for a fifth of the time
MOMENT, JSON_TEXT, BYTES, PLAIN = "moment", "json", "bytes", "plain"
COUNTED = "counted"  # a moment that SQLite keeps as microseconds; text as the others


def kept_tables() -> list[sa.Table]:
    """Return the tables that a backup holds, each after those it refers to."""
    return [table for table in Base.metadata.sorted_tables if table.name not in OF_THE_MOMENT]


@contextmanager
def snapshot(database: Database) -> Iterator[sa.Connection]:
    """Give a connection that sees one moment's state for as long as it is open."""
    options: dict[str, Any] = {"stream_results": True, "yield_per": ROWS_AT_A_TIME}
    if not database.is_sqlite:
        options |= {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
    with database.engine.connect().execution_options(**options) as connection:
        yield connection


def write_table(connection: sa.Connection, table: sa.Table, path: Path) -> TableEntry:
    """Write a table's rows to a file, gzipped; returns what the manifest says of them."""
    kinds = {column.name: _kind(column) for column in table.columns}
    rows = 0
    with gzip.open(path, "wb", compresslevel=QUICK) as target:
        for row in connection.execute(sa.select(*map(_neutral, table.columns))):
            target.write(json.dumps(list(row), default=_text).encode() + b"\n")
            rows += 1
    with path.open("rb") as written:
        return TableEntry(table.name, kinds, rows, sha256_of(written))


def _kind(column: sa.Column[Any]) -> str:
    if isinstance(column.type, UtcDateTime):
        return MOMENT
    if isinstance(column.type, UtcMicroseconds):
        return COUNTED
    if isinstance(column.type, sa.LargeBinary):
        return BYTES
    return JSON_TEXT if isinstance(column.type, sa.JSON) else PLAIN


def _neutral(column: sa.Column[Any]) -> sa.ColumnElement[Any]:
    # A cast would tell SQL's NULL from JSON's null, which reading the column as JSON does not.
    return sa.cast(column, sa.Text) if _kind(column) == JSON_TEXT else column


def _text(value: object) -> str:
    if isinstance(value, datetime):
        return f"{value.astimezone(UTC):%Y-%m-%d %H:%M:%S.%f}+00:00"
    if isinstance(value, bytes):
        return b64encode(value).decode()
    raise TypeError(f"a backup cannot hold a {type(value).__name__}")


def read_rows(lines: Iterator[bytes], table: TableEntry) -> Iterator[Sequence[Any]]:
    """Give the rows that `write_table` wrote, moments and JSON still as text."""
    binary = [at for at, kind in enumerate(table.columns.values()) if kind == BYTES]
    for line in lines:
        row: list[Any] = json.loads(line)
        for at in binary:
            row[at] = None if row[at] is None else b64decode(row[at])
        yield row
