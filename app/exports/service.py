"""Asking for exports, watching them, and keeping their files.

An export runs as a job, because a data set of years takes longer than a request may. What it reads
is fixed by its filters; the same data and filters give the same bytes.
"""

import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.db import Database, now
from app.errors import Conflict, Invalid, NotFound, StorageFull, looked_up_by
from app.exports import repository
from app.exports.filters import ExportFilters, ExportOptions
from app.exports.formats import FORMATS
from app.exports.making import Advanced, Written, write_export
from app.imagery import service as imagery
from app.jobs import JobClient, JobQueue
from app.paging import Paging
from app.runs import service as runs
from app.sites import service as sites
from app.storage import Storage, Stored
from app.storing_together import FULL
from app.tables.exports import Export, ExportStatus
from app.tables.webhooks import WebhookEvent
from app.webhooks.outbox import announce

EXPORT_JOB = "export"
IN_MEMORY_BYTES = 8 << 20
TOLD_EVERY_S = 1.0


class NoLongerWanted(Exception):  # noqa: N818  it is no error
    """An export was cancelled while it was being written."""


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked for: the format, the selection and how it is packed."""

    format_name: str
    filters: ExportFilters
    options: ExportOptions
    site_ids: frozenset[int] | None
    anonymise: bool

    def row(self) -> Export:
        """Return the export as it is stored. Raises Invalid naming `format`."""
        if self.format_name not in FORMATS:
            raise Invalid.field("format", f"must be one of {', '.join(FORMATS)}")
        return Export(
            format=self.format_name,
            filters=self.filters.stored(),
            options=self.options.stored(),
            site_ids=None if self.site_ids is None else sorted(self.site_ids),
            anonymise=self.anonymise,
        )


def request_export(
    session: Session, jobs: JobClient, asked: Request, user_id: int | None
) -> Export:
    """Store a request and put its job into the queue. Raises Invalid naming `format`."""
    export = asked.row()
    export.workflow_id = f"export-{uuid.uuid4()}"
    export.created_by_id = user_id
    session.add(export)
    session.flush()
    jobs.enqueue(session, EXPORT_JOB, export.id, queue=JobQueue.SHORT, job_id=export.workflow_id)
    return export


def get_export(session: Session, export_id: int) -> Export:
    """Return an export. Raises NotFound."""
    export = repository.get(session, export_id)
    if export is None:
        raise NotFound("there is no such export")
    return export


def list_exports(
    session: Session, user_id: int | None, paging: Paging
) -> tuple[Sequence[Export], str | None]:
    """Return a page of a person's exports (None: everybody's)."""
    return repository.listed(session, user_id, paging)


def newest_exports(session: Session, user_id: int | None, limit: int = 50) -> Sequence[Export]:
    """Return the newest exports of a person (None: of everybody)."""
    return repository.newest(session, user_id, limit)


def sites_of(session: Session, filters: ExportFilters) -> Iterator[tuple[str, int]]:
    """Give (filter, site id) of each thing an export shall be of.

    Raises NotFound naming the filter that leads to nothing.
    """
    site_of: Mapping[str, Callable[[int], int]] = {
        "site_id": lambda given: sites.get_site(session, given).id,
        "camera_id": lambda given: sites.get_camera(session, given).site_id,
        "viewport_id": lambda given: sites.site_id_of_viewport(session, given),
        "run_id": lambda given: runs.get_run(session, given).site_id,
        "image_id": lambda given: imagery.get_image(session, given).site_id,
    }
    for name, site_id_of in site_of.items():
        given = getattr(filters, name)
        if given is not None:
            with looked_up_by(f"filters.{name}"):
                yield f"filters.{name}", site_id_of(given)


def refuse_ended(export: Export) -> None:
    """Raise Conflict for an export that has ended."""
    if export.status not in repository.UNDER_WAY:
        raise Conflict(f"the export has {export.status.value}; there is nothing to cancel")


def mark_cancelled(session: Session, export_id: int) -> None:
    """Say that an export was cancelled, unless it has ended."""
    if repository.cancel(session, export_id, now()):
        _announce(session, export_id)


def begin(session: Session, export_id: int) -> None:
    """Say that an export is being written."""
    repository.set_status(session, export_id, ExportStatus.RUNNING, started_at=now())


def make_file(database: Database, storage: Storage, export_id: int) -> tuple[Stored, Written]:
    """Write an export's file into the store; returns its address and what it holds.

    Raises NoLongerWanted when it is cancelled meanwhile, StorageFull when a disk is full.
    """
    with database.reading() as session:
        export = get_export(session, export_id)
    try:
        with tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES) as draft:
            what = write_export(database, export, draft, storage, _teller(database, export_id))
            draft.seek(0)
            return storage.put_stream(draft), what
    except OSError as error:
        if error.errno not in FULL:
            raise
        folder = tempfile.gettempdir()
        raise StorageFull(f"there is no room left in {folder}; free some and try again") from error


def _teller(database: Database, export_id: int) -> Advanced:
    """Return what stores how far an export is, about once a second."""
    told_at = time.monotonic()

    def advanced(done: int, total: int) -> None:
        nonlocal told_at
        if time.monotonic() - told_at < TOLD_EVERY_S:
            return
        told_at = time.monotonic()
        with database.writing() as session:
            if not repository.advance(session, export_id, done, total):
                raise NoLongerWanted

    return advanced


def finish(session: Session, export_id: int, stored: Stored, what: Written) -> None:
    """Say that an export's file is in the store."""
    is_wanted = repository.set_status(
        session,
        export_id,
        ExportStatus.SUCCEEDED,
        sha256=stored.sha256,
        size_bytes=stored.size_bytes,
        item_count=what.count,
        item_total=what.count,
        manifest=dict(what.manifest),
        finished_at=now(),
    )
    if is_wanted:
        _announce(session, export_id)


def fail(session: Session, export_id: int, reason: str) -> None:
    """Say that an export failed, and why."""
    if repository.set_status(
        session, export_id, ExportStatus.FAILED, error=reason, finished_at=now()
    ):
        _announce(session, export_id)


def _announce(session: Session, export_id: int) -> None:
    """Tell the webhooks of the sites that an export is of that it has ended."""
    export = get_export(session, export_id)
    try:
        named = {
            site_id
            for _, site_id in sites_of(session, ExportFilters.model_validate(export.filters))
        }
    except NotFound:
        return  # what it was of is gone, and with it who would want to know
    data = {
        "export_id": export.id,
        "format": export.format,
        "status": export.status.value,
        "error": export.error,
        "poses": export.item_count,
        "url": f"/api/v1/exports/{export.id}",
    }
    of_sites = named or (None if export.site_ids is None else set(export.site_ids))
    announce(session, WebhookEvent.EXPORT_FINISHED, of_sites, data)


def cancel_job(session: Session, workflow_id: str) -> None:
    """Say that the export behind a stopped job was cancelled, unless it has ended."""
    export_id = repository.id_of_job(session, workflow_id)
    if export_id is not None:
        mark_cancelled(session, export_id)


def fail_job(session: Session, workflow_id: str, reason: str) -> None:
    """Say that the export behind a job failed, and why."""
    export_id = repository.id_of_job(session, workflow_id)
    if export_id is not None:
        fail(session, export_id, reason)
