"""Imports side by side, without holding up anybody else who writes.

A recording is written in short transactions, so that live feeds, people and other imports go on
meanwhile. What has to be told is whether an unfinished recording is being written or was left by a
process that died: so each import shares a lock with the others while it lasts, and who has that
lock alone knows that all unfinished ones were left. On SQLite, which has one writer, imports also
queue for each transaction; the database itself would let them sleep and try again. The locks are
locked files beside an SQLite database and locks of a session on Postgres: the system lets both go
when their process dies.
"""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import sqlalchemy as sa

from app.db import Database

_IMPORT_LOCK = 0x4149_5301  # "AIS": any number of ours that no other lock has


@contextmanager
def importing(database: Database) -> Iterator[None]:
    """Tell that an import goes on while the block lasts."""
    with _lock(database, fcntl.LOCK_SH, "pg_advisory_lock_shared", "pg_advisory_unlock_shared"):
        yield


@contextmanager
def none_importing(database: Database) -> Iterator[bool]:
    """Keep imports from beginning while the block lasts; gives False where one goes on."""
    how = fcntl.LOCK_EX | fcntl.LOCK_NB
    with _lock(database, how, "pg_try_advisory_lock", "pg_advisory_unlock") as is_taken:
        yield is_taken


@contextmanager
def turn_to_write(database: Database) -> Iterator[None]:
    """Wait until other imports have written what they are writing now."""
    if not database.is_sqlite:
        yield
        return
    with _locked_file(database, "import-turn", fcntl.LOCK_EX):
        yield


@contextmanager
def _lock(database: Database, how: int, take: str, let_go: str) -> Iterator[bool]:
    """Hold the lock of imports, in one of two ways; gives False if it is not to be had."""
    if database.is_sqlite:
        with _locked_file(database, "imports", how) as is_taken:
            yield is_taken
        return
    with database.engine.connect() as pooled:
        connection = pooled.execution_options(isolation_level="AUTOCOMMIT")
        told = connection.scalar(sa.select(sa.Function(take, _IMPORT_LOCK)))
        is_taken = told is not False  # what waits for a lock tells nothing
        try:
            yield is_taken
        finally:
            if is_taken:
                connection.execute(sa.select(sa.Function(let_go, _IMPORT_LOCK)))


@contextmanager
def _locked_file(database: Database, name: str, how: int) -> Iterator[bool]:
    path = sa.make_url(database.url).database
    if not path or path == ":memory:":
        yield True
        return
    with Path(f"{path}-{name}").open("ab") as file:
        try:
            fcntl.flock(file, how)
        except BlockingIOError:
            yield False
        else:
            yield True  # closing the file lets the lock go
