"""REST of learning from reviews."""

from typing import Annotated

from fastapi import APIRouter

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.dependencies import Page, SessionDep
from app.learning import actions, service
from app.learning.schemas import LearntIn, LearntOut, ProposalOut
from app.sites import actions as sites

router = APIRouter(tags=["learning"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.get("/sites/{site_id:int}/learning")
def get_learning(site_id: int, session: SessionDep, access: Reader) -> ProposalOut:
    """Fit what is probable at a site to its graded images, judged on images left out.

    Nothing is stored: apply it by its key.
    """
    site = sites.site_for(session, access, Scope.READ, site_id)
    return ProposalOut.of(service.propose(session, site.id))


@router.get("/sites/{site_id:int}/learnt-settings")
def list_learnt(site_id: int, session: SessionDep, access: Reader) -> Page[LearntOut]:
    """List a site's learnt settings, newest first."""
    site = sites.site_for(session, access, Scope.READ, site_id)
    return Page(items=[LearntOut.of(row) for row in service.history(session, site.id)])


@router.post("/sites/{site_id:int}/learnt-settings", status_code=201)
def apply_learnt(site_id: int, data: LearntIn, session: SessionDep, access: Registrar) -> LearntOut:
    """Make a proposal count for the site's new runs of preset waterline."""
    site = sites.site_for(session, access, Scope.REGISTER, site_id)
    return LearntOut.of(actions.apply(session, access, site, data.key))


@router.post("/learnt-settings/{learnt_id:int}/undo")
def undo_learnt(learnt_id: int, session: SessionDep, access: Registrar) -> LearntOut:
    """Take a set back: the one before it counts for new runs, or what runs take anyway."""
    return LearntOut.of(actions.undo(session, access, learnt_id))
