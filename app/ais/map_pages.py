"""The page of a site's map: traffic at a moment, moved by a slider; its island draws it."""

from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.ais import coverage_pages, map_repository
from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.feeds import service as feeds
from app.identities import service as identities
from app.sites.actions import site_for
from app.templating import page

router = APIRouter()
router.include_router(coverage_pages.router)
Reader = Annotated[Access, allowed(Scope.READ)]


@router.get("/sites/{site_id:int}/map")
def show_map(request: Request, site_id: int, session: SessionDep, access: Reader) -> Response:
    """Show the traffic around a site; the address tells moment, window, box and vessel."""
    site = site_for(session, access, Scope.READ, site_id)
    view = identities.view(session, site.id)
    settings = request.app.state.settings
    return page(
        request,
        "ais/map.html",
        crumbs=[
            {"label": "Sites", "href": "/sites"},
            {"label": site.name, "href": f"/sites/{site.id}"},
            {"label": "Map"},
        ],
        site=site,
        span=map_repository.span(session, view.readable),
        pseudonyms=view.identities.hidden,
        tile_url=settings.map_tile_url,
        tile_attribution=settings.map_attribution,
        has_feed=bool(feeds.list_views(session, view.readable, feeds.EVERY_FEED, site.id)[0]),
        may_ingest=access.may(Scope.INGEST, site.id),
    )
