"""REST of re-registrations: start, watch, cancel; look at what is proposed, and decide."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.dependencies import DatabaseDep, JobsDep, Page, PagingDep, SessionDep, StorageDep
from app.ids import RowId
from app.openapi_bodies import file_answer
from app.registration import actions as registration
from app.registration.service import camera_of
from app.reregistration import actions, overlay, service
from app.reregistration.schemas import (
    AcceptIn,
    PointingOut,
    ReregistrationIn,
    ReregistrationOut,
    TurnedImageOut,
)

router = APIRouter(tags=["re-registrations"], route_class=IdempotentRoute)
RETRY_AFTER_S = 1
NEVER_CHANGES = "private, max-age=31536000, immutable"

Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.post("/viewports/{viewport_id:int}/reregistrations", status_code=202)
def start_reregistration(
    viewport_id: int,
    body: ReregistrationIn,
    session: SessionDep,
    jobs: JobsDep,
    access: Registrar,
    response: Response,
) -> ReregistrationOut:
    """Have a worker tell how images are turned against a registered viewport."""
    row = actions.start(session, jobs, access, viewport_id, body)
    response.headers["Location"] = f"/api/v1/reregistrations/{row.id}"
    response.headers["Retry-After"] = str(RETRY_AFTER_S)
    return service.shown(session, [row])[0]


@router.get("/viewports/{viewport_id:int}/reregistrations")
def list_viewport_reregistrations(
    viewport_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Page[ReregistrationOut]:
    """List a viewport's re-registrations, oldest first."""
    viewport = registration.viewport_for(session, access, Scope.READ, viewport_id)
    rows, cursor = service.list_reregistrations(session, None, viewport.id, paging)
    return Page(items=service.shown(session, rows), next_cursor=cursor)


@router.get("/reregistrations")
def list_reregistrations(
    session: SessionDep, access: Reader, paging: PagingDep, viewport_id: RowId | None = None
) -> Page[ReregistrationOut]:
    """List the re-registrations of the sites one may read, oldest first."""
    sites = access.site_ids(Scope.READ)
    rows, cursor = service.list_reregistrations(session, sites, viewport_id, paging)
    return Page(items=service.shown(session, rows), next_cursor=cursor)


@router.get("/reregistrations/{reregistration_id:int}")
def get_reregistration(
    reregistration_id: int, session: SessionDep, access: Reader
) -> ReregistrationOut:
    """Return a re-registration and how far it is."""
    row = actions.reregistration_for(session, access, Scope.READ, reregistration_id)
    return service.shown(session, [row])[0]


@router.post("/reregistrations/{reregistration_id:int}/cancel")
def cancel_reregistration(
    reregistration_id: int, database: DatabaseDep, jobs: JobsDep, access: Registrar
) -> ReregistrationOut:
    """Stop before the next images; an ended one stays as it is."""
    actions.cancel(database, jobs, access, reregistration_id)
    with database.reading() as session:
        return service.shown(session, [service.get(session, reregistration_id)])[0]


@router.get("/reregistrations/{reregistration_id:int}/images")
def list_reregistration_images(
    reregistration_id: int,
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    *,
    passed: Annotated[bool | None, Query(description="Only these")] = None,
) -> Page[TurnedImageOut]:
    """List the images in order of time: how each is turned, or why it stays unregistered."""
    row = actions.reregistration_for(session, access, Scope.READ, reregistration_id)
    # The cursor holds the place of the last image, counted from one.
    after = -1 if paging.after is None else paging.after - 1
    found = service.images(session, row.id, passed=passed, after=after, limit=paging.limit + 1)
    return actions.page_of(found, paging, TurnedImageOut.of)


@router.get("/reregistrations/{reregistration_id:int}/pointings")
def list_pointings(
    reregistration_id: int, session: SessionDep, access: Reader
) -> Page[PointingOut]:
    """List the pointings that the images make, in order of time."""
    row = actions.reregistration_for(session, access, Scope.READ, reregistration_id)
    return Page(items=[PointingOut.of(found) for found in service.pointings(session, row.id)])


@router.get("/pointings/{pointing_id:int}")
def show_pointing(pointing_id: int, session: SessionDep, access: Reader) -> PointingOut:
    """Return a pointing."""
    return PointingOut.of(actions.pointing_for(session, access, Scope.READ, pointing_id))


@router.get("/pointings/{pointing_id:int}/overlay")
def show_overlay(
    pointing_id: int, session: SessionDep, access: Reader, image_id: RowId | None = None
) -> dict[str, Any]:
    """Return landmarks and horizon over an image, with the old (before) and turned (after) pose."""
    pointing = actions.pointing_for(session, access, Scope.READ, pointing_id)
    row = service.image_of(session, pointing, image_id)
    return overlay.overlay_of(session, row, pointing.reregistration)


@router.get(
    "/pointings/{pointing_id:int}/reference",
    response_class=Response,
    responses=file_answer("image/jpeg"),
)
def show_reference(
    pointing_id: int,
    session: SessionDep,
    storage: StorageDep,
    access: Reader,
    image_id: RowId | None = None,
) -> Response:
    """Send the reference photograph turned as an image of the pointing is, a JPEG."""
    pointing = actions.pointing_for(session, access, Scope.READ, pointing_id)
    row = service.image_of(session, pointing, image_id)
    parent = pointing.reregistration
    camera, _ = camera_of(session, parent.registration_id)
    data = overlay.warped_reference(storage, parent.reference_image, row, camera)
    return Response(data, media_type="image/jpeg", headers={"Cache-Control": NEVER_CHANGES})


@router.post("/pointings/{pointing_id:int}/accept")
def accept_pointing(
    pointing_id: int, session: SessionDep, access: Registrar, body: AcceptIn | None = None
) -> PointingOut:
    """Make it a viewport with a turned registration; its images then belong to that viewport."""
    pointing = actions.accept(session, access, pointing_id, body or AcceptIn.model_validate({}))
    return PointingOut.of(pointing)


@router.post("/pointings/{pointing_id:int}/reject")
def reject_pointing(pointing_id: int, session: SessionDep, access: Registrar) -> PointingOut:
    """Put it aside; its images stay where they are."""
    return PointingOut.of(actions.reject(session, access, pointing_id))
