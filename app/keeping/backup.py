"""Making a backup while others go on working.

First the tables, all as of one moment, into drafts beside the target; then the files that they
refer to, straight from the store. Files are stored before the rows that speak of them and never
change, so whatever the moment's rows name is there. The archive gets its name when it is whole.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import sha256 as new_sha256
from pathlib import Path

from app import __version__, schema
from app.config import Settings
from app.db import Database, now
from app.errors import Conflict, NotFound
from app.job_tables import unended_jobs
from app.keeping import repository
from app.keeping.archive import (
    HEADER,
    MANIFEST,
    SECRET,
    ArchiveWriter,
    Header,
    JobEntry,
    Manifest,
    TableEntry,
    as_json,
)
from app.keeping.drafts import drafts_beside, whole_or_not
from app.keeping.snapshot import kept_tables, snapshot, write_table
from app.storage import Storage

Told = Callable[[int, int], None]


@dataclass(slots=True)
class _Moment:
    """What stood in the database at the backup's moment."""

    tables: list[TableEntry]
    jobs: list[JobEntry]
    files: list[str]


@dataclass(slots=True)
class _Files:
    """What became of the files."""

    count: int = 0
    size_bytes: int = 0
    missing: list[str] = field(default_factory=list)
    damaged: list[str] = field(default_factory=list)


def make_backup(
    settings: Settings, database: Database, storage: Storage, path: Path, told: Told
) -> Manifest:
    """Write an archive of the installation; `told` hears (files done, files in all).

    Raises Conflict when there is a file of this name. Files that are missing or damaged in the
    store do not stop it; the manifest names them.
    """
    if path.exists():
        raise Conflict(f"{path} exists already; choose another name")
    path.parent.mkdir(parents=True, exist_ok=True)
    with drafts_beside(path) as drafts:
        moment = _take(database, drafts)
        with whole_or_not(drafts, path) as target, ArchiveWriter(target) as archive:
            archive.add_json(HEADER, as_json(_header(database)))
            for table in moment.tables:
                _add_table(archive, table, drafts)
            files = _add_files(archive, storage, moment.files, told)
            secret = _add_secret(archive, settings)
            manifest = Manifest(
                tables=moment.tables,
                jobs=moment.jobs,
                file_count=files.count,
                file_bytes=files.size_bytes,
                missing=files.missing,
                damaged=files.damaged,
                secret_sha256=secret,
            )
            archive.add_json(MANIFEST, as_json(manifest))
    return manifest


def _take(database: Database, drafts: Path) -> _Moment:
    with snapshot(database) as connection:
        return _Moment(
            tables=[write_table(connection, table, drafts / table.name) for table in kept_tables()],
            jobs=[
                JobEntry(job.job_id, job.name, job.queue, job.arguments)
                for job in unended_jobs(connection)
            ],
            files=list(repository.referenced_files(connection)),
        )


def _header(database: Database) -> Header:
    return Header(
        version=__version__,
        revision=schema.head_revision(),
        database="sqlite" if database.is_sqlite else "postgresql",
        created_at=now().isoformat(),
    )


def _add_table(archive: ArchiveWriter, table: TableEntry, drafts: Path) -> None:
    draft = drafts / table.name
    with draft.open("rb") as source:
        archive.add_stream(table.member, source, draft.stat().st_size)
    draft.unlink()


def _add_files(archive: ArchiveWriter, storage: Storage, sha256s: list[str], told: Told) -> _Files:
    files = _Files()
    for done, sha256 in enumerate(sha256s, start=1):
        try:
            size_bytes = storage.size_bytes(sha256)
            with storage.open(sha256) as source:
                found = archive.add_stream(f"files/{sha256}", source, size_bytes)
        except NotFound:
            files.missing.append(sha256)
        else:
            if found == sha256:
                files.count += 1
                files.size_bytes += size_bytes
            else:
                files.damaged.append(sha256)
        told(done, len(sha256s))
    return files


def _add_secret(archive: ArchiveWriter, settings: Settings) -> str | None:
    """Add the secret where it is a file of the installation; one that is given is kept elsewhere.

    Without it a restored installation would not know repeated requests again.
    """
    if settings.secret_key.get_secret_value():
        return None
    secret = settings.secret()
    archive.add_bytes(SECRET, secret)
    return new_sha256(secret).hexdigest()
