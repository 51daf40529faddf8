"""Pages of AIS: recordings with what became of every line, vessels, one vessel's track."""

from typing import Annotated

from fastapi import APIRouter, Form, Query, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.ais import actions, service
from app.ais.drawing import HEIGHT_PX, WIDTH_PX, draw
from app.ais.ship_types import ship_type_name
from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep, SettingsDep, StorageDep
from app.errors import AppError
from app.paging import Paging, decode_cursor
from app.sites import service as sites
from app.tables.ais import AisFile
from app.tables.sites import Site
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]
FILES_SHOWN = 50
VESSELS_SHOWN = 50
REPORTS_SHOWN = 25
ALL_SITES = ""


@router.get("/ais")
def show_ais(
    request: Request,
    session: SessionDep,
    access: Reader,
    q: Annotated[str, Query(max_length=100)] = "",
    cursor: Annotated[str | None, Query(max_length=64)] = None,
    imported: int | None = None,
) -> Response:
    """Show recordings and vessels."""
    flashes = []
    if imported is not None:
        file = service.get_file(session, access.site_ids(Scope.READ), imported)
        flashes.append({"message": _what_came(file), "tone": "success"})
    return _page(request, session, access, search=q, cursor=cursor, flashes=flashes)


@router.post("/ais")
def import_file(
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    site_id: Annotated[str, Form()] = ALL_SITES,
) -> Response:
    """Import a recording and show what became of it."""
    wanted = int(site_id) if site_id.isascii() and site_id.isdigit() else None
    try:
        imported = actions.import_upload(database, storage, settings, access, file, wanted)
    except AppError as error:
        session.rollback()
        with database.reading() as reading:
            refused = {
                "message": f"{file.filename} was not imported: {error.detail}",
                "tone": "error",
            }
            return _page(request, reading, access, site_id=site_id, error=error, flashes=[refused])
    return RedirectResponse(f"/ais?imported={imported.file.id}", status_code=303)


@router.get("/ais/files/{file_id:int}")
def show_file(file_id: int, request: Request, session: SessionDep, access: Reader) -> Response:
    """Show a recording with its whole accounting."""
    file = service.get_file(session, access.site_ids(Scope.READ), file_id)
    return page(
        request,
        "ais/file.html",
        crumbs=[{"label": "AIS", "href": "/ais"}, {"label": file.file_name}],
        file=file,
        site=sites.get_site(session, file.site_id) if file.site_id is not None else None,
    )


@router.get("/ais/vessels/{mmsi:int}")
def show_vessel(mmsi: int, request: Request, session: SessionDep, access: Reader) -> Response:
    """Show a vessel: what it says of itself, where it was."""
    readable = access.site_ids(Scope.READ)
    vessel = service.get_vessel(session, readable, mmsi)
    track = service.track(session, readable, mmsi, None, None)
    statics = service.latest_statics(session, readable, mmsi, REPORTS_SHOWN)
    return page(
        request,
        "ais/vessel.html",
        crumbs=[{"label": "AIS", "href": "/ais"}, {"label": vessel.name or str(mmsi)}],
        vessel=vessel,
        ship_type=ship_type_name(vessel.ship_type),
        hull=next((static for static in statics if static.to_bow_m is not None), None),
        positions=service.latest_positions(session, readable, mmsi, REPORTS_SHOWN),
        track=track,
        position_count=sum(map(len, track.pieces)),
        drawing=draw(track),
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
    )


def _what_came(file: AisFile) -> str:
    counts = file.accounting["messages"]
    parts = (
        (counts["positions"], "new position"),
        (counts["statics"], "static report"),
        (file.accounting["vessels"], "vessel"),
    )
    told = ", ".join(f"{count:,} {noun}{'' if count == 1 else 's'}" for count, noun in parts)
    return f"{file.file_name}: {told}."


def _page(
    request: Request,
    session: Session,
    access: Access,
    *,
    search: str = "",
    cursor: str | None = None,
    site_id: str = ALL_SITES,
    error: AppError | None = None,
    flashes: list[dict[str, str]] | None = None,
) -> Response:
    readable = access.site_ids(Scope.READ)
    paging = Paging(limit=VESSELS_SHOWN, after=decode_cursor(cursor) if cursor else None)
    vessels, next_cursor = service.list_vessels(session, readable, paging, search)
    errors = {part.field: part.message for part in (error.fields if error else ())}
    return page(
        request,
        "ais/index.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "AIS"}],
        files=service.newest_files(session, readable, FILES_SHOWN),
        site_names={site.id: site.name for site in _sites(session, readable)},
        vessels=[(vessel, ship_type_name(vessel.ship_type)) for vessel in vessels],
        next_cursor=next_cursor,
        cursor=cursor,
        search=search,
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
