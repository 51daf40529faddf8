"""Imports take turns, without holding up anybody else who writes.

A recording is written in many short transactions, so that live feeds and people go on meanwhile.
Two recordings with the same fixes must still not be written at once, because each would take the
other's unfinished rows for known. So one import at a time has the turn, in all processes: through
a locked file beside an SQLite database, through a lock of the session on Postgres. Both are let go
by the system when their process dies, so whatever is unfinished when the turn is taken was left.
"""

import fcntl
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import sqlalchemy as sa

from app.db import Database
from app.errors import Unavailable

_IMPORT_LOCK = 0x4149_5301  # "AIS": any number of ours that no other lock has
_LONGEST_PAUSE_S = 0.2
_locks: dict[str, threading.Lock] = {}


@contextmanager
def import_turn(database: Database, *, wait_s: float | None = None) -> Iterator[None]:
    """Hold the turn while the block lasts.

    Raises Unavailable, with nothing done, when others have it for longer than `wait_s`.
    """
    deadline = None if wait_s is None else time.monotonic() + wait_s
    # Connections are few: within a process only one waits for other processes.
    own = _locks.setdefault(database.url, threading.Lock())
    if not own.acquire(timeout=-1 if wait_s is None else wait_s):
        raise _busy()
    try:
        with _taken_from_others(database, deadline):
            yield
    finally:
        own.release()


@contextmanager
def _taken_from_others(database: Database, deadline: float | None) -> Iterator[None]:
    if not database.is_sqlite:
        with database.engine.connect() as pooled:
            connection = pooled.execution_options(isolation_level="AUTOCOMMIT")
            _wait(
                lambda: bool(
                    connection.scalar(sa.select(sa.func.pg_try_advisory_lock(_IMPORT_LOCK)))
                ),
                deadline,
            )
            try:
                yield
            finally:
                connection.execute(sa.select(sa.func.pg_advisory_unlock(_IMPORT_LOCK)))
        return
    path = sa.make_url(database.url).database
    if not path or path == ":memory:":
        yield
        return
    with Path(f"{path}-imports").open("ab") as file:
        _wait(lambda: _has_locked(file.fileno()), deadline)
        yield  # closing the file lets the lock go


def _has_locked(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _wait(take: Callable[[], bool], deadline: float | None) -> None:
    pause_s = 0.002
    while not take():
        if deadline is not None and time.monotonic() > deadline:
            raise _busy()
        time.sleep(pause_s)
        pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)


def _busy() -> Unavailable:
    return Unavailable("another recording is being stored; nothing was changed, try again soon")
