"""REST of exports: ask, watch, download.

An export belongs to the person who asked for it; nobody else finds it, because it was selected
with that person's rights.
"""

from typing import Annotated, Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.delivery import immutable_headers, is_known, not_modified, send_stream, wanted_part
from app.dependencies import DatabaseDep, JobsDep, PagingDep, SessionDep, StorageDep
from app.errors import Conflict
from app.exports import service
from app.exports.actions import cancel
from app.exports.filters import ExportOptions
from app.exports.formats import MEDIA_TYPES, file_kind
from app.exports.rights import (
    exportable_sites,
    own_export,
    owner_filter,
    refuse_lost_rights,
)
from app.exports.schemas import ExportIn, ExportOut
from app.exports.writers.datasheet import datasheet
from app.openapi_bodies import PART_OF_FILE, file_answer
from app.paging import Page
from app.tables.exports import Export, ExportStatus

router = APIRouter(tags=["exports"], route_class=IdempotentRoute)
RETRY_AFTER_S = 1

Exporter = Annotated[Access, allowed(Scope.EXPORT)]


@router.post("/exports", status_code=202)
def request_export(
    body: ExportIn, session: SessionDep, jobs: JobsDep, access: Exporter, response: Response
) -> ExportOut:
    """Ask for an export; a worker writes it. Vessel ids are pseudonyms unless said otherwise."""
    sites = exportable_sites(session, access, body.filters, anonymise=body.anonymise)
    asked = service.Request(body.format, body.filters, body.options(), sites, body.anonymise)
    export = service.request_export(session, jobs, asked, access.user_id)
    record(session, access, "request", "export", export.id, site_id=body.filters.site_id)
    response.headers["Location"] = f"/api/v1/exports/{export.id}"
    response.headers["Retry-After"] = str(RETRY_AFTER_S)
    return ExportOut.of(export)


@router.get("/exports")
def list_exports(session: SessionDep, access: Exporter, paging: PagingDep) -> Page[ExportOut]:
    """List one's own exports, oldest first; an administrator sees everybody's."""
    exports, cursor = service.list_exports(session, owner_filter(access), paging)
    return Page(items=[ExportOut.of(export) for export in exports], next_cursor=cursor)


@router.get("/exports/{export_id}")
def get_export(
    export_id: int, session: SessionDep, access: Exporter, response: Response
) -> ExportOut:
    """Return an export and how far it is."""
    export = own_export(session, access, export_id)
    if export.status in {ExportStatus.QUEUED, ExportStatus.RUNNING}:
        response.headers["Retry-After"] = str(RETRY_AFTER_S)
    return ExportOut.of(export)


@router.post("/exports/{export_id}/cancel")
def cancel_export(
    export_id: int, database: DatabaseDep, jobs: JobsDep, access: Exporter
) -> ExportOut:
    """Stop an export that waits or is being written; 409 for one that has ended."""
    return ExportOut.of(cancel(database, jobs, access, export_id))


@router.get("/exports/{export_id}/manifest")
def get_manifest(export_id: int, session: SessionDep, access: Exporter) -> dict[str, Any]:
    """Tell what an export holds and where it comes from: filters, counts, runs, files, code."""
    export = own_export(session, access, export_id)
    refuse_lost_rights(session, access, export)
    return _manifest(export)


@router.get("/exports/{export_id}/datasheet", response_class=PlainTextResponse)
def get_datasheet(export_id: int, session: SessionDep, access: Exporter) -> Response:
    """Return an export's datasheet (Markdown), with the paper's tables for its selection."""
    export = own_export(session, access, export_id)
    refuse_lost_rights(session, access, export)
    return PlainTextResponse(datasheet(_manifest(export)), media_type="text/markdown")


def _manifest(export: Export) -> dict[str, Any]:
    if export.manifest is None:
        raise Conflict(f"the export is {export.status.value}; ask again once it has succeeded")
    return {**export.manifest, "sha256": export.sha256, "size_bytes": export.size_bytes}


@router.get(
    "/exports/{export_id}/download",
    response_class=Response,
    responses=file_answer(*MEDIA_TYPES) | PART_OF_FILE,
)
def download_export(
    export_id: int, request: Request, session: SessionDep, storage: StorageDep, access: Exporter
) -> Response:
    """Send an export's file; takes Range and If-None-Match."""
    export = own_export(session, access, export_id)
    refuse_lost_rights(session, access, export)
    if export.sha256 is None or export.size_bytes is None:
        raise Conflict(f"the export is {export.status.value}; download it once it has succeeded")
    media_type, suffix = file_kind(export.format, ExportOptions.model_validate(export.options))
    etag = f'"{export.sha256}"'
    name = f"quaymark-export-{export.id}.{suffix}"
    headers = immutable_headers(etag, f'attachment; filename="{name}"')
    if is_known(request, etag):
        return not_modified(headers)
    part = wanted_part(request, export.size_bytes, etag)
    stream = storage.open(export.sha256)
    return send_stream(stream, part, export.size_bytes, media_type, headers)
