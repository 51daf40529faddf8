"""The page of exports: ask for one, download those that are ready.

A selection stands in the URL under the names that REST and the command have for it, so that a link
from a list of poses, or one that was kept, opens the form filled in.
"""

from typing import Annotated, Any

from fastapi import APIRouter, Form, Query, Request, Response
from fastapi.responses import RedirectResponse
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.dependencies import DatabaseDep, JobsDep, SessionDep
from app.exports import service
from app.exports.actions import cancel
from app.exports.filters import ExportFilters, ExportOptions
from app.exports.formats import FORMATS
from app.exports.identities import REMAINS
from app.exports.rights import exportable_sites, owner_filter
from app.exports.schemas import pace
from app.paging import Paging
from app.runs import service as runs
from app.sites import service as sites
from app.tables.exports import Export
from app.templating import page

router = APIRouter()

MORE_FILTERS = ExportFilters.model_json_schema()["properties"].keys() - {"run_id", "grade", "poses"}

Exporter = Annotated[Access, allowed(Scope.EXPORT)]


class FilterFields(BaseModel):
    """The filters as a form or a URL has them: text, empty where nothing is asked."""

    model_config = ConfigDict(extra="forbid", populate_by_name=True)

    run_id: str = ""
    site_id: str = ""
    camera_id: str = ""
    viewport_id: str = ""
    image_id: str = ""
    since: str = Field("", alias="from")
    until: str = Field("", alias="to")
    mmsi: str = ""
    grade: list[str] = Field(default_factory=list)
    state: str = ""
    reviewer: str = ""
    verdict: str = ""
    range_min_m: str = ""
    range_max_m: str = ""
    flag: str = ""
    corrected: str = ""
    person_made: str = ""
    poses: str = ""
    updated_since: str = ""

    def values(self) -> dict[str, Any]:
        """Return what was filled in."""
        return {name: value for name, value in self.model_dump(by_alias=True).items() if value}


class ExportFields(FilterFields):
    """The form of a new export."""

    format: str = ""
    images: bool = False
    archive: bool = False
    split: str = ""
    seed: str = "0"
    with_identities: bool = False

    def filters(self) -> ExportFilters:
        """Return the filters. Raises ValidationError."""
        names = FilterFields.model_fields
        chosen = FilterFields.model_construct(**{name: getattr(self, name) for name in names})
        return ExportFilters.model_validate(chosen.values())

    def options(self) -> ExportOptions:
        """Return how the poses are packed. Raises ValidationError."""
        split = {"by": self.split, "seed": self.seed or "0"} if self.split else None
        return ExportOptions.model_validate(
            {"images": self.images, "archive": self.archive, "split": split}
        )


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
    """Ask for an export and show the list."""
    try:
        filters, options = asked.filters(), asked.options()
    except ValidationError as error:
        return _page(request, session, access, asked, error=_told(error))
    if asked.format not in FORMATS:
        return _page(request, session, access, asked, error="Choose a format from the list.")
    anonymise = not (asked.with_identities and access.may_anywhere(Scope.REVIEW))
    export = service.request_export(
        session,
        jobs,
        service.Request(
            asked.format,
            filters,
            options,
            exportable_sites(session, access, filters, anonymise=anonymise),
            anonymise,
        ),
        access.user_id,
    )
    record(session, access, "request", "export", export.id)
    return RedirectResponse("/exports", status_code=303)


@router.post("/exports/{export_id:int}/cancel")
def cancel_export(
    export_id: int, database: DatabaseDep, jobs: JobsDep, access: Exporter
) -> Response:
    """Stop an export and show the list."""
    cancel(database, jobs, access, export_id)
    return RedirectResponse("/exports", status_code=303)


def _told(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    if first["loc"] and first["loc"][0] in {"run_id", "site_id", "grade", "split"}:
        return "Choose the run, the site, grades and parts from the lists."
    name = f"{first['loc'][0]}: " if first["loc"] else ""
    return f"{name}{first['msg'].removeprefix('Value error, ')}"


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
        exports=[(export, _selection(export), *pace(export)) for export in exports],
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


def _selection(export: Export) -> str:
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
