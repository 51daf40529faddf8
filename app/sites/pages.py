"""Pages of sites: all of them, one with its cameras and viewports, and the form for both."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.db import Database
from app.dependencies import DatabaseDep, SessionDep
from app.feeds import service as feeds
from app.forms import ENTRY_ERRORS, Form, Submitted, check_version, parse, rejected
from app.imagery import service as imagery
from app.paging import Paging
from app.registration import service as registration
from app.registration.overview import NO_IMAGES, lines_of
from app.reviews import service as reviews
from app.runs import service as runs
from app.sites import actions, camera_pages, service
from app.sites.next_step import next_step
from app.sites.schemas import SiteIn, SitePatch
from app.tables.sites import Site
from app.templating import page

router = APIRouter()
router.include_router(camera_pages.router)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
ALL = Paging(limit=1000, after=None)
RUNS_SHOWN = 5
SITES = {"label": "Sites", "href": "/sites"}
NEW_SITE = Form({"timezone": "UTC", "origin.height_m": "0", "water_level_m": "0"})


@router.get("/sites")
def show_sites(request: Request, session: SessionDep, access: Reader) -> Response:
    """List the sites one may read."""
    sites, _ = service.list_sites(session, access.site_ids(Scope.READ), ALL)
    return page(
        request,
        "sites/list.html",
        sites=sites,
        alarms=feeds.alarms(session, access.site_ids(Scope.READ)),
        counts=service.site_counts(session, [site.id for site in sites]),
        may_create=access.may(Scope.REGISTER, None),
    )


@router.get("/sites/new")
def new_site(request: Request, access: Registrar) -> Response:
    """Show the form for a new site."""
    access.require(Scope.REGISTER, None)
    return _form_page(request, None, NEW_SITE)


@router.post("/sites")
def create_site(
    request: Request, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Make a site and show it."""
    try:
        data = parse(SiteIn, entered)
        with database.writing() as session:
            site = actions.create_site(session, access, data)
    except ENTRY_ERRORS as error:
        return _form_page(request, None, rejected(entered, error), error.status)
    return RedirectResponse(f"/sites/{site.id}", status_code=303)


@router.get("/sites/{site_id:int}")
def show_site(request: Request, site_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a site: its cameras, its viewports with their quality, and what to do next."""
    site = actions.site_for(session, access, Scope.READ, site_id)
    readable = access.site_ids(Scope.READ)
    cameras, _ = service.list_cameras(session, readable, site.id, ALL)
    viewports, _ = registration.list_viewports(session, readable, ALL, site_id=site.id)
    images = imagery.spans_of_cameras(session, [camera.id for camera in cameras])
    counts = service.site_counts(session, [site.id])[site.id]
    lines = lines_of(session, viewports)
    newest = runs.newest_runs(session, frozenset({site.id}), RUNS_SHOWN)
    verdicts = reviews.verdicts_by_run(session, [run.id for run, _ in newest])
    return page(
        request,
        "sites/site.html",
        crumbs=[SITES, {"label": site.name}],
        site=site,
        cameras=[(camera, images.get(camera.id, NO_IMAGES)) for camera in cameras],
        feeds=feeds.list_views(session, readable, site_id=site.id)[0],
        lines=lines,
        counts=counts,
        step=next_step(site, counts, cameras, lines),
        runs=[(run, done, verdicts[run.id]) for run, done in newest],
        reviewable=access.site_ids(Scope.REVIEW),
        may_register=access.may(Scope.REGISTER, site.id),
        may_administer=access.may(Scope.ADMIN, site.id),
        may_ingest=access.may(Scope.INGEST, site.id),
    )


@router.get("/sites/{site_id:int}/edit")
def edit_site(request: Request, site_id: int, session: SessionDep, access: Registrar) -> Response:
    """Show the form that changes a site."""
    site = actions.site_for(session, access, Scope.REGISTER, site_id)
    return _form_page(request, site, Form(_values(site)))


@router.post("/sites/{site_id:int}")
def update_site(
    request: Request, site_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Change a site and show it."""
    try:
        data = parse(SitePatch, {k: v for k, v in entered.items() if k != "version"})
        with database.writing() as session:
            site = actions.site_for(session, access, Scope.REGISTER, site_id)
            check_version(entered, site.version)
            actions.update_site(session, access, site, data)
    except ENTRY_ERRORS as error:
        form = rejected(entered, error)
        return _edit_again(request, database, access, site_id, form, error.status)
    return RedirectResponse(f"/sites/{site_id}", status_code=303)


def _edit_again(
    request: Request, database: Database, access: Access, site_id: int, form: Form, status: int
) -> Response:
    # Asked again: the form may be wrong before anybody asked whose site it is.
    with database.reading() as session:
        site = actions.site_for(session, access, Scope.REGISTER, site_id)
        return _form_page(request, site, form, status)


def _form_page(request: Request, site: Site | None, form: Form, status: int = 200) -> Response:
    place = {"label": site.name, "href": f"/sites/{site.id}"} if site else None
    last = {"label": "Edit" if site else "New site"}
    return page(
        request,
        "sites/edit.html",
        status_code=status,
        crumbs=[crumb for crumb in (SITES, place, last) if crumb],
        site=site,
        form=form,
    )


def _values(site: Site) -> dict[str, object]:
    return {
        "name": site.name,
        "origin.lat_deg": site.origin_lat_deg,
        "origin.lon_deg": site.origin_lon_deg,
        "origin.height_m": site.origin_height_m,
        "water_level_m": site.water_level_m,
        "timezone": site.timezone,
        "shows_pseudonyms": "true" if site.shows_pseudonyms else "false",
    }
