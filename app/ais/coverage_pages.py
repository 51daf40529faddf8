"""The page of AIS coverage: days with images, and one day, drawn over its hours and listed."""

from datetime import date
from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.ais import coverage
from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.feeds import service as feeds
from app.identities import service as identities
from app.sites.actions import site_for
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
IMAGES_LISTED = 500
SECONDS_A_PX = 90


@router.get("/sites/{site_id:int}/coverage")
def show_coverage(
    request: Request, site_id: int, session: SessionDep, access: Reader, day: date | None = None
) -> Response:
    """Show which images of a day have AIS around them; without a day, of the last with images."""
    site = site_for(session, access, Scope.READ, site_id)
    readable = identities.view(session, site.id).readable
    days = coverage.days(session, site.id, readable)
    chosen = day or (days[0][0] if days else None)
    found = coverage.of_day(session, site, readable, chosen) if chosen else None
    return page(
        request,
        "ais/coverage.html",
        crumbs=[
            {"label": "Sites", "href": "/sites"},
            {"label": site.name, "href": f"/sites/{site.id}"},
            {"label": "AIS coverage"},
        ],
        site=site,
        days=days,
        suspect_clocks=feeds.suspect_clocks(session, readable, site.id),
        found=found,
        marks=[
            (_second(image) // SECONDS_A_PX, image) for image in (found.images if found else ())
        ],
        most=max((image.near for image in found.images), default=0) if found else 0,
        listed=IMAGES_LISTED,
        width_px=86_400 // SECONDS_A_PX,
    )


def _second(image: coverage.ImageCoverage) -> int:
    moment = image.captured_at
    return moment.hour * 3600 + moment.minute * 60 + moment.second
