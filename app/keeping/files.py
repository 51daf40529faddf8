"""Stored files looked at again, whether they are there and still what they were.

Disks forget silently. So every file that some row refers to is hashed again once a day, slowly
enough that nobody notices; what is missing or changed stands on the administrators' pages and in
the metrics until it is whole again, for instance restored from a backup.
"""

import threading
from dataclasses import dataclass

import structlog

from app.db import Database
from app.errors import NotFound
from app.keeping import repository
from app.storage import Storage
from app.tables.operation import FileProblem

log = structlog.get_logger()


@dataclass(frozen=True, slots=True)
class Checked:
    """What a look at all files came to."""

    files: int
    size_bytes: int
    missing: int
    damaged: int


def check_files(
    database: Database,
    storage: Storage,
    *,
    bytes_per_s: float = float("inf"),
    stop: threading.Event | None = None,
) -> Checked:
    """Hash every file that a row refers to, no faster than so, and keep what is wrong.

    Ends early when told to stop; what was found so far is kept.
    """
    stop = stop or threading.Event()
    with database.engine.connect() as connection:
        wanted = list(repository.referenced_files(connection))
    with database.reading() as session:
        known = repository.findings(session)
    files = size_bytes = 0
    found: dict[str, FileProblem] = {}
    for sha256 in wanted:
        problem, read_bytes = _look_at(storage, sha256)
        files, size_bytes = files + 1, size_bytes + read_bytes
        if problem is not None:
            found[sha256] = problem
        if problem is not known.get(sha256):
            _note(database, sha256, problem)
        if stop.wait(read_bytes / bytes_per_s):
            break
    else:
        for sha256 in known.keys() - set(wanted):
            _note(database, sha256, None)  # nothing refers to it any more
    problems = list(found.values())
    return Checked(
        files,
        size_bytes,
        problems.count(FileProblem.MISSING),
        problems.count(FileProblem.DAMAGED),
    )


def _look_at(storage: Storage, sha256: str) -> tuple[FileProblem | None, int]:
    try:
        size_bytes = storage.size_bytes(sha256)
    except NotFound:
        return FileProblem.MISSING, 0
    return (None if storage.is_whole(sha256) else FileProblem.DAMAGED), size_bytes


def _note(database: Database, sha256: str, problem: FileProblem | None) -> None:
    if problem is not None:
        log.error("stored file is not whole", sha256=sha256, problem=problem.value)
    with database.writing() as session:
        repository.keep_finding(session, sha256, problem)
