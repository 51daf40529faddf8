"""Is everything that the database says so? References, files, sums of what was read."""

from collections.abc import Iterator

import sqlalchemy as sa

from app.db import Database
from app.errors import Invalid
from app.keeping import repository
from app.keeping.loading import check_references
from app.storage import Storage

MOST_NAMED = 3


def problems(database: Database, storage: Storage) -> Iterator[str]:
    """Give what is wrong, a line each; files are looked for and not hashed."""
    with database.engine.connect() as connection:
        try:
            check_references(connection)
        except Invalid as error:
            yield error.detail
        stored = set(storage.addresses())
        lost = [
            sha256 for sha256 in repository.referenced_files(connection) if sha256 not in stored
        ]
        if lost:
            yield f"{len(lost)} files are missing in the store: {_named(lost)}"
        for file_id, name in _unbalanced(connection):
            yield f"recording {file_id} ({name}): its lines, sentences and messages do not add up"
        for run_id, told, counted in repository.runs_miscounted(connection):
            yield f"run {run_id}: {told} images announced, {counted} there"


def orphans(database: Database, storage: Storage) -> int:
    """Count stored files that no row refers to; deleted images leave some for a while."""
    with database.engine.connect() as connection:
        wanted = set(repository.referenced_files(connection))
    return sum(sha256 not in wanted for sha256 in storage.addresses())


def _unbalanced(connection: sa.Connection) -> Iterator[tuple[int, str]]:
    for file_id, name, accounting in repository.accountings(connection):
        sentences, messages = accounting["sentences"], accounting["messages"]
        lines = accounting["lines"]
        told = lines["sentence"] + lines["time_only"] + lines["other"] + lines["dropped"]
        kept = messages["positions"] + messages["statics"] + messages["duplicates"]
        gone = messages["ignored_type"] + sum(messages["rejected"].values())
        if told != lines["total"] or sentences["pending"] or kept + gone != messages["assembled"]:
            yield file_id, name


def _named(sha256s: list[str]) -> str:
    return ", ".join(sha256s[:MOST_NAMED]) + (", ..." if len(sha256s) > MOST_NAMED else "")
