"""The pages of exports: ask for one, see what it would hold, download what is ready.

A selection stands in the URL under the names that REST and the command have for it, so that a link
from a list of poses, or one that was kept, opens the form filled in.
"""

from typing import Annotated
from urllib.parse import parse_qsl

from fastapi import APIRouter, Form, Query, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.config import Settings
from app.dependencies import DatabaseDep, JobsDep, SessionDep, SettingsDep
from app.errors import Invalid
from app.exports import service
from app.exports.actions import cancel
from app.exports.curl import download_command, request_command
from app.exports.filters import ExportFilters, ExportOptions
from app.exports.form_fields import ExportFields
from app.exports.formats import FORMATS, file_kind
from app.exports.identities import REMAINS
from app.exports.preview import look
from app.exports.rights import own_export, owner_filter
from app.exports.schemas import pace
from app.paging import Paging
from app.runs import service as runs
from app.sites import service as sites
from app.tables.exports import Export
from app.templating import page

router = APIRouter()

MORE_FILTERS = ExportFilters.model_json_schema()["properties"].keys() - {"run_id", "grade", "poses"}

COLUMNS = {
    "captured_at": "Taken",
    "vessel": "Vessel",
    "grade": "Grade",
    "lat_deg": "Latitude, °",
    "lon_deg": "Longitude, °",
    "heading_deg": "Heading, °",
}

Exporter = Annotated[Access, allowed(Scope.EXPORT)]


@router.get("/exports")
def list_exports(
    request: Request,
    session: SessionDep,
    access: Exporter,
    asked: Annotated[ExportFields, Query()],
) -> Response:
    """List one's exports, with the form for a new one, filled in as the URL says."""
    return _page(request, session, access, asked)


@router.post("/exports")
def request_export(
    request: Request,
    session: SessionDep,
    jobs: JobsDep,
    access: Exporter,
    asked: Annotated[ExportFields, Form()],
) -> Response:
    """Ask for an export and show how far it is."""
    try:
        wanted = asked.asked(session, access)
    except Invalid as error:
        return _page(request, session, access, asked, error=error.detail)
    export = service.request_export(session, jobs, wanted, access.user_id)
    record(session, access, "request", "export", export.id, site_id=wanted.filters.site_id)
    return RedirectResponse(f"/exports/{export.id}", status_code=303)


@router.get("/exports/preview")
def preview_export(
    request: Request,
    session: SessionDep,
    access: Exporter,
    settings: SettingsDep,
    asked: Annotated[ExportFields, Query()],
) -> Response:
    """Show what an export would hold before it is made."""
    if parse_qsl(request.url.query, keep_blank_values=True) != parse_qsl(asked.query()):
        # Without what was left empty it is an address worth keeping.
        return RedirectResponse(f"/exports/preview?{asked.query()}", status_code=303)
    try:
        wanted = asked.asked(session, access)
    except Invalid as error:
        return _page(request, session, access, asked, error=error.detail)
    return page(
        request,
        "exports/preview.html",
        crumbs=[{"label": "Exports", "href": "/exports"}, {"label": "What it holds"}],
        form=FORMATS[wanted.format_name],
        selection=selection_of(wanted.row()),
        filters=wanted.filters.stored(),
        suffix=file_kind(wanted.format_name, wanted.options)[1],
        wanted=wanted,
        asked=asked,
        fields=list(parse_qsl(asked.query())),
        held=look(session, wanted),
        columns=COLUMNS,
        command=request_command(_address(request, settings), wanted),
    )


@router.get("/exports/{export_id:int}")
def show_export(
    request: Request, export_id: int, session: SessionDep, access: Exporter, settings: SettingsDep
) -> Response:
    """Show an export: how far it is, then what it holds and how to get it."""
    export = own_export(session, access, export_id)
    options = ExportOptions.model_validate(export.options)
    suffix = file_kind(export.format, options)[1]
    asked = service.Request(
        export.format,
        ExportFilters.model_validate(export.filters),
        options,
        None,
        export.anonymise,
    )
    address = _address(request, settings)
    rate, remaining = pace(export)
    return page(
        request,
        "exports/export.html",
        crumbs=[{"label": "Exports", "href": "/exports"}, {"label": f"No. {export.id}"}],
        export=export,
        form=FORMATS[export.format],
        selection=selection_of(export),
        suffix=suffix,
        rate=rate,
        remaining=remaining,
        again=ExportFields.of(export).query(),
        request_command=request_command(address, asked),
        download_command=download_command(address, export, suffix),
    )


@router.post("/exports/{export_id:int}/cancel")
def cancel_export(
    export_id: int, database: DatabaseDep, jobs: JobsDep, access: Exporter
) -> Response:
    """Stop an export and show it."""
    cancel(database, jobs, access, export_id)
    return RedirectResponse(f"/exports/{export_id}", status_code=303)


def _page(
    request: Request,
    session: SessionDep,
    access: Access,
    asked: ExportFields,
    *,
    error: str = "",
) -> Response:
    readable = access.site_ids(Scope.EXPORT)
    newest = runs.newest_runs(session, readable)
    exports = service.newest_exports(session, owner_filter(access))
    return page(
        request,
        "exports/list.html",
        status_code=422 if error else 200,
        crumbs=[{"label": "Exports"}],
        exports=[(export, selection_of(export), *pace(export)) for export in exports],
        waiting=any(export.status.value in {"queued", "running"} for export in exports),
        formats=FORMATS,
        runs=[(run.id, f"{runs.label(run)} ({progress.poses} poses)") for run, progress in newest],
        sites=[
            (site.id, site.name)
            for site in sites.list_sites(session, readable, Paging(limit=200, after=None))[0]
        ],
        asked=asked,
        narrowed=bool(asked.values().keys() & MORE_FILTERS),
        may_identify=access.may_anywhere(Scope.REVIEW),
        remains=REMAINS,
        error=error,
    )


def selection_of(export: Export) -> str:
    """Return an export's filters and options in a line, without the grades."""
    filters, options = export.filters, export.options
    told = [f"Run {filters['run_id']}" if "run_id" in filters else "All runs"]
    told += [
        f"{name.replace('_', ' ').removesuffix(' id')} {value}"
        for name, value in filters.items()
        if name not in {"run_id", "grade"}
    ]
    if options.get("split"):
        told.append(f"parts by {options['split']['by']}")
    told += [word for word in ("images", "archive") if options.get(word)]
    return ", ".join(told)


def _address(request: Request, settings: Settings) -> str:
    return settings.public_url or str(request.base_url)
