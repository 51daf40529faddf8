"""The first page of who is signed in; who is not is led to the sign-in page."""

from fastapi import APIRouter, Depends, Request
from fastapi.responses import RedirectResponse, Response

from app import disk_room
from app.auth.access import Scope, access_of, public
from app.auth.destination import SIGN_IN
from app.dependencies import SessionDep, SettingsDep, StorageDep
from app.feeds import service as feeds
from app.home import service
from app.templating import page

router = APIRouter()


@router.get("/", dependencies=[Depends(public)])
def show_home(
    request: Request, session: SessionDep, settings: SettingsDep, storage: StorageDep
) -> Response:
    """Show what needs help and what to do next; strangers sign in, viewers see the sites."""
    access = access_of(request)
    if access is None:
        return RedirectResponse(SIGN_IN, status_code=303)
    sets_up, reviews = access.may_anywhere(Scope.INGEST), access.may_anywhere(Scope.REVIEW)
    if not (sets_up or reviews):
        return RedirectResponse("/sites", status_code=303)
    site, steps = service.first_steps(session, access) if sets_up else (None, None)
    return page(
        request,
        "home/home.html",
        alarms=feeds.alarms(session, access.site_ids(Scope.INGEST)) if sets_up else [],
        scarce=disk_room.scarce(settings, storage) if access.is_admin else [],
        site=site,
        steps=steps,
        reviews=reviews,
        work=service.work_left(session, access) if reviews else None,
    )
