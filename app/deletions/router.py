"""REST of deletions: what would go along, what was deleted, and bringing it back."""

from typing import Annotated

from fastapi import APIRouter, Query

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.deletions import actions, service, things
from app.deletions.schemas import DeletionOut, Entity, ExtentOut
from app.dependencies import Page, PagingDep, SessionDep
from app.ids import RowId
from app.runs import service as runs

router = APIRouter(tags=["deletions"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]


@router.get("/deletions/preview")
def preview_deletion(
    session: SessionDep,
    access: Reader,
    entity: Entity,
    identifier: Annotated[RowId, Query(alias="id")],
) -> ExtentOut:
    """Count what would go along with something that can be deleted.

    A series of water levels (`water_levels`) is named by the id of its site.
    """
    things.thing_for(session, access, Scope.READ, entity, identifier)
    counts = service.preview(session, entity, [identifier])
    stale = runs.resting_on_recording(session, identifier) if entity == "ais_file" else []
    return ExtentOut(entity=entity, id=identifier, counts=counts, stale_runs=len(stale))


@router.get("/deletions")
def list_deletions(session: SessionDep, access: Reader, paging: PagingDep) -> Page[DeletionOut]:
    """List what was deleted and can still be brought back, oldest first."""
    deletions, cursor = service.list_deletions(session, access.site_ids(Scope.READ), paging)
    return Page(items=[DeletionOut.of(each) for each in deletions], next_cursor=cursor)


@router.get("/deletions/{deletion_id:int}")
def get_deletion(deletion_id: int, session: SessionDep, access: Reader) -> DeletionOut:
    """Show a deletion that can still be undone."""
    return DeletionOut.of(actions.deletion_for(session, access, deletion_id))


@router.post("/deletions/{deletion_id:int}/restore", status_code=204)
def restore_deletion(deletion_id: int, session: SessionDep, access: Reader) -> None:
    """Bring back what a deletion took, exactly as it was; needs what deleting it needs."""
    actions.restore(session, access, deletion_id)
