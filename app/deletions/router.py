"""REST of deletions: what would go along, what was deleted, and bringing it back."""

from typing import Annotated

from fastapi import APIRouter, Query
from sqlalchemy.orm import Session

from app.ais import actions as ais
from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.deletions import actions, service
from app.deletions.schemas import DeletionOut, Entity, ExtentOut
from app.dependencies import Page, PagingDep, SessionDep
from app.ids import RowId
from app.imagery import actions as imagery
from app.registration import actions as registration
from app.runs import actions as run_actions
from app.runs import service as runs
from app.sites import actions as sites

router = APIRouter(tags=["deletions"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]


@router.get("/deletions/preview")
def preview_deletion(
    session: SessionDep,
    access: Reader,
    entity: Entity,
    identifier: Annotated[RowId, Query(alias="id")],
) -> ExtentOut:
    """Count what would go along with a site, camera, viewport, run, image or AIS recording."""
    _require_readable(session, access, entity, identifier)
    counts = service.preview(session, entity, [identifier])
    stale = runs.resting_on_recording(session, identifier) if entity == "ais_file" else []
    return ExtentOut(entity=entity, id=identifier, counts=counts, stale_runs=len(stale))


def _require_readable(session: Session, access: Access, entity: Entity, identifier: int) -> None:
    look_up = {
        "site": sites.site_for,
        "camera": sites.camera_for,
        "viewport": registration.viewport_for,
        "run": run_actions.run_for,
        "image": imagery.image_for,
        "ais_file": ais.file_for,
    }[entity]
    look_up(session, access, Scope.READ, identifier)


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
