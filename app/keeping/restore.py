"""Putting a backup back into an empty installation, or in the place of what is there.

Nothing is touched before every member of the archive has been hashed. Then the files go into the
store, and all tables are made, filled and brought up to this version in one transaction: a restore
happens or does not. Jobs that had not ended are queued again under their names.
"""

import gzip
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app import schema
from app.config import Settings
from app.db import Database, now
from app.errors import Conflict, Invalid
from app.job_tables import forget_jobs
from app.jobs import JobClient, JobQueue, migrate_job_tables
from app.keeping import repository
from app.keeping.archive import OWNER_ONLY, SECRET, Archive, Manifest
from app.keeping.loading import check_references, continue_numbering, load
from app.keeping.snapshot import kept_tables, read_rows
from app.operation.repository import count_workers_seen
from app.storage import Storage

WORKER_GONE_AFTER = timedelta(seconds=15)
Told = Callable[[int], None]


def restore_backup(
    settings: Settings,
    database: Database,
    storage: Storage,
    path: Path,
    *,
    force: bool,
    told: Told,
) -> Manifest:
    """Restore an archive; `told` hears of each member checked.

    Raises Invalid for an archive that is not whole or of a newer version; Conflict for an
    installation with data in it (unless `force`) or with a worker at work.
    """
    with Archive(path) as archive:
        if archive.header.revision not in schema.known_revisions():
            raise Invalid(
                f"{path} was made by Quaymark {archive.header.version} (database "
                f"{archive.header.revision}), which is newer than this; upgrade Quaymark first"
            )
        _refuse_if_in_use(database, force=force)
        archive.verify(told)
        _restore_files(archive, storage)
        migrate_job_tables(database.url)
        _restore_tables(database, archive, force=force)
        _restore_secret(settings, archive)
        return archive.manifest


def check_backup(path: Path, told: Told) -> Archive:
    """Hash everything in an archive and return it. Raises Invalid naming what is wrong."""
    with Archive(path) as archive:
        archive.verify(told)
        return archive


def _refuse_if_in_use(database: Database, *, force: bool) -> None:
    with database.engine.connect() as connection:
        filled = repository.first_filled(connection, kept_tables())
        has_workers = sa.inspect(connection).has_table("worker_heartbeats")
    if filled is not None and not force:
        raise Conflict(
            f"this installation is not empty (there are {filled}); restore into an empty one, or "
            "give --force to replace all that is in it"
        )
    if has_workers:
        with database.reading() as session:
            if count_workers_seen(session, since=now() - WORKER_GONE_AFTER):
                raise Conflict(
                    "a worker is at work here; stop web and workers, and try again in 15 seconds"
                )


def _restore_files(archive: Archive, storage: Storage) -> None:
    for sha256 in archive.files():
        if storage.is_whole(sha256):
            continue
        # Damaged since: a file in its place would not be replaced.
        storage.remove(sha256, untouched_for_s=0.0)
        with archive.open(f"files/{sha256}") as source:
            storage.put_stream(source)


def _restore_tables(database: Database, archive: Archive, *, force: bool) -> None:
    revision = archive.header.revision
    current = schema.current_revision(database)
    jobs = JobClient(database.url)
    try:
        with schema.migrating(database) as connection:
            if current is not None and (force or current != revision):
                schema.downgrade_within(connection, "base")
            schema.upgrade_within(connection, revision)
            _load_tables(connection, archive)
            schema.upgrade_within(connection)
            check_references(connection)
            forget_jobs(connection)
            _queue_again(connection, jobs, archive)
    finally:
        jobs.destroy()


def _load_tables(connection: sa.Connection, archive: Archive) -> None:
    for table in archive.manifest.tables:
        with (
            archive.open(table.member) as member,
            gzip.open(member, "rb") as lines,
        ):
            loaded = load(connection, table, read_rows(iter(lines), table))
        if loaded != table.rows:
            raise Invalid(f"{table.name}: {loaded} of {table.rows} rows could be restored")
    continue_numbering(connection, archive.manifest.tables)


def _queue_again(connection: sa.Connection, jobs: JobClient, archive: Archive) -> None:
    with Session(bind=connection) as session:
        for job in archive.manifest.jobs:
            jobs.enqueue(
                session, job.name, *job.arguments, queue=JobQueue(job.queue), job_id=job.job_id
            )
        session.flush()


def _restore_secret(settings: Settings, archive: Archive) -> None:
    if archive.manifest.secret_sha256 is None or settings.secret_key.get_secret_value():
        return
    path = settings.data_dir / "secret"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(mode=OWNER_ONLY)
    path.write_bytes(archive.read(SECRET))
