"""Pages of a recording on its way in: what it holds, how it is read, how far the import is."""

from collections.abc import Mapping
from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.ais import actions, uploads
from app.ais.preview_schemas import FIELD_NAMES, PreviewOut, mapping_of_form
from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.config import Settings
from app.db import now
from app.dependencies import DatabaseDep, JobsDep, SessionDep, SettingsDep, StorageDep
from app.errors import AppError
from app.forms import ENTRY_ERRORS, Submitted
from app.ids import RowId
from app.sites import service as sites
from app.storage import Storage
from app.tables.ais_uploads import AisUpload, UploadState
from app.templating import DASH, page, size

router = APIRouter()
Operator = Annotated[Access, allowed(Scope.INGEST)]
SHOWN_AS_PROGRESS = (UploadState.QUEUED, UploadState.IMPORTING, UploadState.IMPORTED)
TAB = "\t"
OPTIONS = {
    "delimiter": [(",", "Comma"), (";", "Semicolon"), (TAB, "Tab"), ("|", "Bar |")],
    "decimal": [(".", "Point: 53.54"), (",", "Comma: 53,54")],
    "time_format": [
        ("iso", "Year first, or epoch: 2024-05-31 12:00:00, 1717156800"),
        ("day_first", "Day first: 31/05/2024 12:00:00"),
        ("month_first", "Month first: 5/31/2024 12:00:00 PM"),
        ("compact", "Without marks: 20240531120000"),
    ],
    "speed_unit": [("kn", "Knots"), ("m/s", "Metres a second"), ("km/h", "Kilometres an hour")],
}


@router.get("/ais/uploads/{upload_id:int}")
def show_upload(
    upload_id: RowId,
    request: Request,
    session: SessionDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    *,
    following: bool = False,
) -> Response:
    """Show what an uploaded recording holds, or how far its import is."""
    upload = actions.upload_for(session, access, upload_id)
    if upload.state in SHOWN_AS_PROGRESS or (following and upload.reason):
        return _progress_page(request, upload)
    return _preview_page(request, session, storage, settings, upload)


@router.post("/ais/uploads/{upload_id:int}/mapping")
def set_mapping(
    upload_id: RowId,
    request: Request,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    entered: Submitted,
) -> Response:
    """Read the table in another way, and show what comes of it."""
    try:
        mapping = mapping_of_form(entered)
        with database.writing() as session:
            upload = actions.upload_for(session, access, upload_id)
            uploads.set_mapping(session, upload.id, mapping)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            upload = actions.upload_for(session, access, upload_id)
            return _preview_page(request, session, storage, settings, upload, entered, error)
    return RedirectResponse(f"/ais/uploads/{upload_id}#table", status_code=303)


@router.post("/ais/uploads/{upload_id:int}/import")
def start_import(
    upload_id: RowId,
    request: Request,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Operator,
) -> Response:
    """Let the worker import the recording."""
    try:
        with database.writing() as session:
            upload = actions.upload_for(session, access, upload_id)
            uploads.start(session, jobs, upload.id)
            record(
                session,
                access,
                "import",
                "ais_upload",
                upload.id,
                upload.site_id,
                file_name=upload.file_name,
            )
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            upload = actions.upload_for(session, access, upload_id)
            if upload.state not in SHOWN_AS_PROGRESS:
                return _preview_page(request, session, storage, settings, upload, {}, error)
    return RedirectResponse(f"/ais/uploads/{upload_id}?following=1", status_code=303)


@router.post("/ais/uploads/{upload_id:int}/stop")
def stop_import(upload_id: RowId, session: SessionDep, access: Operator) -> Response:
    """Stop the import; what it has stored is removed."""
    upload = actions.upload_for(session, access, upload_id)
    uploads.stop(session, upload.id)
    return RedirectResponse(f"/ais/uploads/{upload_id}", status_code=303)


@router.post("/ais/uploads/{upload_id:int}/discard")
def discard(
    upload_id: RowId, database: DatabaseDep, storage: StorageDep, access: Operator
) -> Response:
    """Remove an upload that nobody wants."""
    with database.reading() as session:
        upload = actions.upload_for(session, access, upload_id)
    uploads.discard(database, storage, upload.id)
    return RedirectResponse("/ais", status_code=303)


def _progress_page(request: Request, upload: AisUpload) -> Response:
    return page(
        request,
        "ais/importing.html",
        crumbs=_crumbs(upload),
        upload=upload,
        percent=round(100 * upload.progress),
        pace=_pace(upload),
    )


def _pace(upload: AisUpload) -> str:
    """Say how fast an import goes and how long it still takes, once that can be told."""
    if upload.started_at is None or not 0 < upload.progress < 1:
        return ""
    elapsed_s = max(1.0, (now() - upload.started_at).total_seconds())
    left_s = elapsed_s * (1 - upload.progress) / upload.progress
    rate = size(int(upload.size_bytes * upload.progress / elapsed_s))
    return f"{rate} a second, {timedelta(seconds=round(left_s))} left"


def _preview_page(
    request: Request,
    session: Session,
    storage: Storage,
    settings: Settings,
    upload: AisUpload,
    entered: Mapping[str, str] | None = None,
    error: AppError | None = None,
) -> Response:
    seen = PreviewOut.of(uploads.look(storage, settings, upload))
    site = sites.get_site(session, upload.site_id) if upload.site_id is not None else None
    mapping = seen.table.mapping if seen.table else {}
    chosen = {f"column.{index}": name for name, index in mapping.get("columns", {}).items()}
    return page(
        request,
        "ais/upload.html",
        status_code=error.status if error else 200,
        crumbs=_crumbs(upload),
        upload=upload,
        seen=seen,
        site_name=site.name if site else "All sites",
        fields=[("", DASH), *FIELD_NAMES.items()],
        options=OPTIONS,
        values={**mapping, **chosen, **(entered or {})},
        errors={part.field: part.message for part in (error.fields if error else ())},
        message=error.detail if error else "",
    )


def _crumbs(upload: AisUpload) -> list[dict[str, str]]:
    return [{"label": "AIS", "href": "/ais"}, {"label": upload.file_name}]
