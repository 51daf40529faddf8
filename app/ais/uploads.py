"""A recording's way in: sent, looked at, its columns set right, then imported by the worker.

Its bytes are stored when they arrive, so that nobody sends gigabytes twice. The import is a job:
it goes on when the page is closed or the worker dies, says how far it is and can be stopped. What
nobody imports is removed after a day.
"""

import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import closing
from datetime import timedelta
from typing import IO

from sqlalchemy.orm import Session

from app.ais import upload_repository
from app.ais.importing import Imported, Importer, Source, import_recording, known_file
from app.ais.preview import Preview, preview
from app.ais.rows import printable
from app.config import Settings
from app.db import Database, now
from app.domain.table_mapping import TableMapping
from app.errors import AppError, Conflict, Invalid, NotFound
from app.jobs import JobClient, JobQueue
from app.storage import Storage
from app.tables.ais_uploads import AisUpload, UploadState

IMPORT_JOB = "import-ais"
KEPT_FOR = timedelta(days=1)
_LONGEST_FILE_NAME = 255
_TOLD_EVERY_S = 0.5


class StoppedError(AppError):
    """Somebody stopped the import."""

    status = 409
    title = "Stopped"


def stage(
    database: Database,
    storage: Storage,
    settings: Settings,
    stream: IO[bytes],
    *,
    file_name: str,
    site_id: int | None,
    user_id: int | None,
) -> AisUpload | Imported:
    """Keep a recording to look at; one that is imported already is returned as such.

    Raises Invalid for what is no recording, TooLarge for an archive made to harm; nothing is kept
    then.
    """
    known = known_file(database, stream, site_id)
    if known is not None:
        return Imported(known, created=False)
    preview(stream, max_bytes=settings.max_ais_file_bytes)
    stream.seek(0)
    stored = storage.put_stream(stream)
    with database.writing() as session:
        left = upload_repository.remove_older(session, now() - KEPT_FOR)
        upload = AisUpload(
            site_id=site_id,
            sha256=stored.sha256,
            size_bytes=stored.size_bytes,
            file_name=printable(file_name, _LONGEST_FILE_NAME) or "recording",
            workflow_id=f"ais-import-{uuid.uuid4()}",
            created_by_id=user_id,
        )
        session.add(upload)
    _sweep(database, storage, left)
    return upload


def get(session: Session, upload_id: int) -> AisUpload:
    """Return an upload. Raises NotFound."""
    upload = upload_repository.upload(session, upload_id)
    if upload is None:
        raise NotFound("there is no such upload")
    return upload


def waiting(session: Session, site_ids: frozenset[int] | None) -> Sequence[AisUpload]:
    """Return the uploads of some sites (None: of all) that are not imported, newest first."""
    return upload_repository.not_imported(session, site_ids)


def look(storage: Storage, settings: Settings, upload: AisUpload) -> Preview:
    """Decode the first lines of an upload."""
    with closing(storage.open(upload.sha256)) as stream:
        return preview(stream, max_bytes=settings.max_ais_file_bytes, mapping=mapping_of(upload))


def mapping_of(upload: AisUpload) -> TableMapping | None:
    """Return what somebody said of the table's columns."""
    return TableMapping.of(upload.mapping, is_whole=False) if upload.mapping else None


def _chosen(upload: AisUpload) -> TableMapping | None:
    """Return the mapping to import by, None where it is to be proposed."""
    mapping = mapping_of(upload)
    return mapping if mapping is not None and mapping.columns else None


def set_mapping(session: Session, upload_id: int, mapping: TableMapping) -> None:
    """Keep what somebody says of the table's columns. Raises Conflict once the import began."""
    upload = get(session, upload_id)
    _expect(upload, UploadState.WAITING, UploadState.FAILED, UploadState.CANCELLED)
    upload.mapping = mapping.as_dict()


def start(session: Session, jobs: JobClient, upload_id: int) -> AisUpload:
    """Let the worker import an upload.

    Raises Conflict when it does so already, Invalid while its columns are not known.
    """
    upload = get(session, upload_id)
    _expect(upload, UploadState.WAITING, UploadState.FAILED, UploadState.CANCELLED)
    mapping = mapping_of(upload)
    if mapping is not None and mapping.columns and mapping.missing:
        raise Invalid.field("columns", f"say which column holds {', '.join(mapping.missing)}")
    upload.state, upload.reason, upload.progress = UploadState.QUEUED, None, 0.0
    upload.workflow_id, upload.started_at = f"ais-import-{uuid.uuid4()}", None
    session.flush()
    jobs.enqueue(session, IMPORT_JOB, upload.id, queue=JobQueue.SHORT, job_id=upload.workflow_id)
    return upload


def stop(session: Session, upload_id: int) -> AisUpload:
    """Stop an import; the worker removes what it has stored so far."""
    upload = get(session, upload_id)
    if upload.state in upload_repository.RUNNING:
        upload.state, upload.reason = UploadState.CANCELLED, "somebody stopped it"
    return upload


def discard(database: Database, storage: Storage, upload_id: int) -> None:
    """Remove an upload and its bytes. Raises Conflict while it is being imported."""
    with database.writing() as session:
        upload = get(session, upload_id)
        if upload.state in upload_repository.RUNNING:
            raise Conflict("it is being imported; stop that first")
        sha256 = upload.sha256
        session.delete(upload)
    _sweep(database, storage, {sha256})


def run_import(database: Database, storage: Storage, settings: Settings, upload_id: int) -> None:
    """Import an upload; done again from its beginning by whoever takes over.

    Raises StoppedError when somebody stopped it, and what importing raises.
    """
    with database.writing() as session:
        upload = get(session, upload_id)
        if upload.state not in upload_repository.RUNNING:
            raise StoppedError("somebody stopped it")
        upload.state, upload.started_at = UploadState.IMPORTING, upload.started_at or now()
    importer = Importer(upload.site_id, upload.created_by_id, told=_teller(database, upload_id))
    with closing(storage.open(upload.sha256)) as stream:
        source = Source(stream, upload.file_name, settings.max_ais_file_bytes, _chosen(upload))
        imported = import_recording(database, storage, source, importer)
    with database.writing() as session:
        upload = get(session, upload_id)
        upload.state, upload.progress, upload.file_id = UploadState.IMPORTED, 1.0, imported.file.id


def fail(session: Session, upload_id: int, reason: str) -> None:
    """Say that an upload was not imported, and why; one that was stopped stays so."""
    upload = upload_repository.upload(session, upload_id)
    if upload is not None and upload.state in upload_repository.RUNNING:
        upload.state, upload.reason = UploadState.FAILED, reason


def fail_job(session: Session, workflow_id: str, reason: str) -> None:
    """Say that the upload behind a job was not imported, and why."""
    upload = upload_repository.of_job(session, workflow_id)
    if upload is not None:
        fail(session, upload.id, reason)


def _sweep(database: Database, storage: Storage, sha256s: set[str]) -> None:
    """Remove the bytes of uploads that are gone, unless a recording or another upload has them."""
    with database.reading() as session:
        unused = upload_repository.unused(session, sha256s)
    for sha256 in unused:
        storage.remove(sha256)


def _teller(database: Database, upload_id: int) -> Callable[[float], None]:
    """Return what notes an import's progress, now and then, and raises once nobody wants it."""
    last = 0.0

    def tell(progress: float) -> None:
        nonlocal last
        if time.monotonic() - last < _TOLD_EVERY_S:
            return
        with database.writing() as session:
            is_wanted = upload_repository.advance(session, upload_id, progress)
        if not is_wanted:
            raise StoppedError("somebody stopped it")
        last = time.monotonic()

    return tell


def _expect(upload: AisUpload, *states: UploadState) -> None:
    if upload.state not in states:
        raise Conflict(f"this recording is {upload.state.value} already")
