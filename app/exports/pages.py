"""The page of exports: ask for one, download those that are ready."""

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse
from pydantic import ValidationError

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.dependencies import JobsDep, SessionDep
from app.exports import service
from app.exports.filters import ExportFilters
from app.exports.identities import REMAINS
from app.exports.rights import exportable_sites, owner_filter
from app.runs import service as runs
from app.templating import page

router = APIRouter()

Exporter = Annotated[Access, allowed(Scope.EXPORT)]


@router.get("/exports")
def list_exports(
    request: Request, session: SessionDep, access: Exporter, run_id: int | None = None
) -> Response:
    """List one's exports, with the form for a new one."""
    return _page(request, session, access, run_id=run_id)


@router.post("/exports")
def request_export(
    request: Request,
    session: SessionDep,
    jobs: JobsDep,
    access: Exporter,
    format_name: Annotated[str, Form(alias="format")],
    run_id: Annotated[str, Form()] = "",
    grade: Annotated[list[str] | None, Form()] = None,
    *,
    with_identities: Annotated[bool, Form()] = False,
) -> Response:
    """Ask for an export and show the list."""
    try:
        filters = ExportFilters.model_validate({"run_id": run_id or None, "grade": grade or None})
    except ValidationError:
        return _page(request, session, access, error="Choose a run and grades from the lists.")
    if format_name not in service.WRITERS:
        return _page(request, session, access, error="Choose a format from the list.")
    anonymise = not (with_identities and access.may_anywhere(Scope.REVIEW))
    export = service.request_export(
        session,
        jobs,
        format_name=format_name,
        filters=filters,
        site_ids=exportable_sites(session, access, filters, anonymise=anonymise),
        anonymise=anonymise,
        user_id=access.user_id,
    )
    record(session, access, "request", "export", export.id)
    return RedirectResponse("/exports", status_code=303)


def _page(
    request: Request,
    session: SessionDep,
    access: Access,
    *,
    run_id: int | None = None,
    error: str = "",
) -> Response:
    newest = runs.newest_runs(session, access.site_ids(Scope.EXPORT))
    exports = service.newest_exports(session, owner_filter(access))
    return page(
        request,
        "exports/list.html",
        status_code=422 if error else 200,
        crumbs=[{"label": "Exports"}],
        exports=exports,
        waiting=any(export.status.value in {"queued", "running"} for export in exports),
        runs=[(run.id, f"{runs.label(run)} ({progress.poses} poses)") for run, progress in newest],
        run_id=run_id,
        may_identify=access.may_anywhere(Scope.REVIEW),
        remains=REMAINS,
        error=error,
    )
