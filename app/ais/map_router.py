"""REST of a site's map: the tracks of a stretch of time, and what its cameras look at."""

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Query, Response

from app.ais import coverage_router, map_repository
from app.ais.area import Area
from app.ais.fields_of_view import seen_from
from app.ais.map_answer import as_json
from app.ais.map_schemas import FieldOfViewOut, NewsOut, StretchOut
from app.ais.map_tracks import MOST_SENT, news, stretch
from app.ais.moments import Moment
from app.auth.access import Access, Scope, allowed
from app.db import now
from app.dependencies import Page, SessionDep
from app.identities import service as identities
from app.sites.actions import site_for

router = APIRouter(tags=["AIS"])
router.include_router(coverage_router.router)
LARGEST_ID = 2**63 - 1
HALF_AN_HOUR = timedelta(minutes=30)
Reader = Annotated[Access, allowed(Scope.READ)]


@router.get("/sites/{site_id}/ais/tracks", response_model=StretchOut)
def list_ais_tracks(
    site_id: int,
    session: SessionDep,
    access: Reader,
    start: Annotated[
        Moment | None, Query(alias="from", description="Left out: the last half hour with AIS")
    ] = None,
    end: Annotated[
        Moment | None, Query(alias="to", description="At most six hours later; else half an hour")
    ] = None,
    bbox: Annotated[
        str | None, Query(max_length=120, description="min_lon,min_lat,max_lon,max_lat")
    ] = None,
    tolerance_m: Annotated[
        float, Query(ge=0, le=10_000, description="How far off a drawn track may be")
    ] = 5.0,
    points: Annotated[
        int, Query(ge=100, le=MOST_SENT, description="At most about so many points in all")
    ] = MOST_SENT,
) -> Response:
    """Return all tracks heard around a site in a stretch of time, thinned for a map.

    Points are whole numbers, each the difference from the one before, so that a thousand tracks
    of half an hour are about a megabyte. Where there are more points than wanted, all tracks are
    thinned further; `tolerance_m` of the answer says to what.
    """
    site = site_for(session, access, Scope.READ, site_id)
    view = identities.view(session, site.id)
    if start is None:
        span = map_repository.span(session, view.readable)
        start = (end or (span[1] if span else now())) - HALF_AN_HOUR
    found = stretch(
        session,
        view.readable,
        start,
        end or start + HALF_AN_HOUR,
        Area.parse(bbox) if bbox else None,
        tolerance_m,
        points,
    )
    return Response(as_json(found, view.identities), media_type="application/json")


@router.get("/sites/{site_id}/ais/tracks/new", response_model=NewsOut)
def list_new_ais_positions(
    site_id: int,
    session: SessionDep,
    access: Reader,
    after: Annotated[
        int | None,
        Query(ge=0, le=LARGEST_ID, description="`after` of the last answer; left out: from now on"),
    ] = None,
    bbox: Annotated[
        str | None, Query(max_length=120, description="min_lon,min_lat,max_lon,max_lat")
    ] = None,
) -> Response:
    """Return only what a site's live feeds brought since the last answer, for a map that follows.

    Ask without `after` first, then for the tracks of the last half hour, then again every few
    seconds. Whoever stays away for long is told so by `is_cut`.
    """
    site = site_for(session, access, Scope.READ, site_id)
    view = identities.view(session, site.id)
    area = Area.parse(bbox) if bbox else None
    begun = map_repository.newest_id(session) if after is None else after
    found, last, is_cut = news(session, view.readable, begun, area)
    told = as_json(found, view.identities, after=last, is_cut=is_cut)
    return Response(told, media_type="application/json", headers={"Cache-Control": "no-store"})


@router.get("/sites/{site_id}/fields-of-view")
def list_fields_of_view(site_id: int, session: SessionDep, access: Reader) -> Page[FieldOfViewOut]:
    """List what the registered viewports of a site look at, as fans on the map."""
    site = site_for(session, access, Scope.READ, site_id)
    items = []
    for seen in seen_from(session, site):
        fan, viewport = seen.fan(), seen.viewport
        items.append(
            FieldOfViewOut(
                viewport_id=viewport.id,
                name=viewport.name,
                camera=viewport.camera.name,
                valid_from=viewport.valid_from,
                valid_until=viewport.valid_until,
                lat_deg=[lat_deg for lat_deg, _ in fan],
                lon_deg=[lon_deg for _, lon_deg in fan],
            )
        )
    return Page(items=items)
