"""Pages of AIS: recordings with what became of every line, and the vessels they speak of."""

from typing import Annotated

from fastapi import APIRouter, Form, Query, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.ais import actions, map_pages, service, uploads, vessel_pages
from app.ais.ship_types import ship_type_name
from app.ais.vessel_list import listed
from app.ais.vessel_schemas import VesselOut
from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep, SettingsDep, StorageDep, reader_of
from app.errors import AppError
from app.identities import service as identities
from app.ids import RowId
from app.paging import Paging, decode_cursor
from app.sites import service as sites
from app.tables.ais import AisFile
from app.tables.sites import Site
from app.templating import page

router = APIRouter()
for part in (vessel_pages, map_pages):
    router.include_router(part.router)
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]
FILES_SHOWN = 50
VESSELS_SHOWN = 50
ALL_SITES = ""


@router.get("/ais")
def show_ais(
    request: Request,
    session: SessionDep,
    access: Reader,
    q: Annotated[str, Query(max_length=100)] = "",
    cursor: Annotated[str | None, Query(max_length=64)] = None,
    imported: int | None = None,
    seen_from: RowId | None = None,
) -> Response:
    """Show recordings and vessels."""
    flashes = []
    if imported is not None:
        file = service.get_file(session, access.site_ids(Scope.READ), imported)
        flashes.append({"message": f"Here already: {_what_came(session, file)}", "tone": "info"})
    return _page(
        request, session, access, search=q, cursor=cursor, seen_from=seen_from, flashes=flashes
    )


@router.post("/ais")
def send_file(
    request: Request,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    site_id: Annotated[str, Form()] = ALL_SITES,
) -> Response:
    """Keep a recording to be looked at; one that is here already is shown as it is."""
    wanted = int(site_id) if site_id.isascii() and site_id.isdigit() else None
    try:
        staged = actions.stage_upload(database, storage, settings, access, file, wanted)
    except AppError as error:
        with database.reading() as reading:
            identities.read_by(reading, reader_of(access))
            refused = {
                "message": f"{file.filename} was not taken: {error.detail}",
                "tone": "error",
            }
            return _page(request, reading, access, site_id=site_id, error=error, flashes=[refused])
    if isinstance(staged, service.Imported):
        return RedirectResponse(f"/ais?imported={staged.file.id}", status_code=303)
    return RedirectResponse(f"/ais/uploads/{staged.id}", status_code=303)


@router.get("/ais/files/{file_id:int}")
def show_file(file_id: int, request: Request, session: SessionDep, access: Reader) -> Response:
    """Show a recording with its whole accounting."""
    file = service.get_file(session, access.site_ids(Scope.READ), file_id)
    name = _name_of(session, file)
    return page(
        request,
        "ais/file.html",
        crumbs=[{"label": "AIS", "href": "/ais"}, {"label": name}],
        file=file,
        name=name,
        site=sites.get_site(session, file.site_id) if file.site_id is not None else None,
        hidden=identities.at_site(session, file.site_id).hidden,
        may_see_rejected=access.may_anywhere(Scope.INGEST),
        may_delete=access.may(Scope.INGEST, file.site_id),
    )


def _name_of(session: Session, file: AisFile) -> str:
    """Return what a recording is called: its file's name, unless that may tell a vessel."""
    return identities.at_site(session, file.site_id).name(file.file_name) or f"Recording {file.id}"


def _what_came(session: Session, file: AisFile) -> str:
    counts = file.accounting["messages"]
    parts = (
        (counts["positions"], "new position"),
        (counts["statics"], "static report"),
        (file.accounting["vessels"], "vessel"),
    )
    told = ", ".join(f"{count:,} {noun}{'' if count == 1 else 's'}" for count, noun in parts)
    return f"{_name_of(session, file)}: {told}."


def _page(
    request: Request,
    session: Session,
    access: Access,
    *,
    search: str = "",
    cursor: str | None = None,
    seen_from: int | None = None,
    site_id: str = ALL_SITES,
    error: AppError | None = None,
    flashes: list[dict[str, str]] | None = None,
) -> Response:
    readable = access.site_ids(Scope.READ)
    paging = Paging(limit=VESSELS_SHOWN, after=decode_cursor(cursor) if cursor else None)
    files = service.newest_files(session, readable, FILES_SHOWN)
    if seen_from is not None:
        access.require(Scope.READ, seen_from)
    seen = identities.view(session, seen_from)
    vessels, next_cursor = listed(session, seen, paging, search)
    told = seen.identities
    errors = {part.field: part.message for part in (error.fields if error else ())}
    return page(
        request,
        "ais/index.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "AIS"}],
        files=files,
        site_names={site.id: site.name for site in _sites(session, readable)},
        vessels=[
            (VesselOut.of(vessel, told), ship_type_name(vessel.ship_type)) for vessel in vessels
        ],
        pseudonyms=told.hidden,
        seen_from=seen_from,
        file_names={file.id: _name_of(session, file) for file in files},
        next_cursor=next_cursor,
        cursor=cursor,
        search=search,
        uploads=uploads.waiting(session, access.site_ids(Scope.INGEST)),
        site_choices=_site_choices(session, access),
        site_id=site_id,
        errors=errors,
        message=error.detail if error and not errors else "",
        may_import=access.may_anywhere(Scope.INGEST),
        flashes=flashes or [],
    )


def _site_choices(session: Session, access: Access) -> list[tuple[str, str]]:
    own = [(str(site.id), site.name) for site in _sites(session, access.site_ids(Scope.INGEST))]
    shared = [(ALL_SITES, "All sites")] if access.may(Scope.INGEST, None) else []
    return [*shared, *own]


def _sites(session: Session, site_ids: frozenset[int] | None) -> list[Site]:
    found, _ = sites.list_sites(session, site_ids, Paging(limit=1000, after=None))
    return list(found)
