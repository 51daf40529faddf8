"""The page of what a site's reviews teach: the proposal, what it is worth, and its history."""

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep
from app.errors import Conflict
from app.learning import actions, service
from app.sites import actions as sites
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
LABELS = (
    (
        "unidentified_per_image",
        "Boxes without AIS, an image",
        "Silent vessels, false positives.",
    ),
    ("detected_share", "Vessels with AIS that are detected", "Of those in the picture."),
    ("score_weight", "Weight of a detection's score", "0: all boxes alike."),
    ("score_center", "Even score, as log odds", "A score that speaks neither for nor against."),
    ("maximum_cost", "Highest matching cost", "Of matching paper."),
)


@router.get("/sites/{site_id:int}/learning")
def show_learning(request: Request, site_id: int, session: SessionDep, access: Reader) -> Response:
    """Show what a site's graded images say of its next runs."""
    return _page(request, session, access, site_id)


@router.post("/sites/{site_id:int}/learnt-settings")
def apply_learnt(
    request: Request,
    site_id: int,
    database: DatabaseDep,
    access: Registrar,
    key: Annotated[str, Form(max_length=64)] = "",
) -> Response:
    """Apply the proposal that was shown, and show the history."""
    try:
        with database.writing() as session:
            site = sites.site_for(session, access, Scope.REGISTER, site_id)
            actions.apply(session, access, site, key)
    except Conflict as error:
        with database.reading() as session:
            return _page(request, session, access, site_id, error)
    return RedirectResponse(f"/sites/{site_id}/learning", status_code=303)


@router.post("/learnt-settings/{learnt_id:int}/undo")
def undo_learnt(learnt_id: int, session: SessionDep, access: Registrar) -> Response:
    """Take a set back and show the history."""
    row = actions.undo(session, access, learnt_id)
    return RedirectResponse(f"/sites/{row.site_id}/learning", status_code=303)


def _page(
    request: Request,
    session: SessionDep,
    access: Access,
    site_id: int,
    error: Conflict | None = None,
) -> Response:
    site = sites.site_for(session, access, Scope.READ, site_id)
    return page(
        request,
        "learning/site.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": site.name, "href": f"/sites/{site.id}"}, {"label": "Learnt settings"}],
        site=site,
        proposal=service.propose(session, site.id),
        history=service.history(session, site.id),
        labels=LABELS,
        message=error.detail if error else "",
        may_apply=access.may(Scope.REGISTER, site.id),
    )
