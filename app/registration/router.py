"""REST of viewports, keypoints and registrations."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, set_etag
from app.dependencies import DatabaseDep, Page, PagingDep, SessionDep
from app.registration import actions, service
from app.registration.editing import preview_of
from app.registration.preview import solve_preview
from app.registration.preview_schemas import SolveIn, SolveOut
from app.registration.schemas import (
    KeypointOut,
    KeypointsBody,
    RegistrationIn,
    RegistrationOut,
    ViewportIn,
    ViewportOut,
    ViewportPatch,
)
from app.tables.sites import Viewport

router = APIRouter(tags=["viewports"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.post("/viewports", status_code=201)
def create_viewport(
    data: ViewportIn, session: SessionDep, access: Registrar, response: Response
) -> ViewportOut:
    """Make a viewport; the camera's images of its time become its own."""
    viewport = actions.create_viewport(session, access, data)
    set_etag(response, viewport.version)
    response.headers["Location"] = f"/api/v1/viewports/{viewport.id}"
    return _shown(session, [viewport])[0]


@router.get("/viewports")
def list_viewports(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    camera_id: int | None = None,
    site_id: int | None = None,
) -> Page[ViewportOut]:
    """List the viewports of the sites the caller may read."""
    viewports, next_cursor = service.list_viewports(
        session, access.site_ids(Scope.READ), paging, camera_id=camera_id, site_id=site_id
    )
    return Page(items=_shown(session, viewports), next_cursor=next_cursor)


@router.get("/viewports/{viewport_id:int}")
def get_viewport(
    viewport_id: int, session: SessionDep, access: Reader, response: Response
) -> ViewportOut:
    """Show a viewport; its ETag is what an edit sends as If-Match."""
    viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
    set_etag(response, viewport.version)
    return _shown(session, [viewport])[0]


@router.patch("/viewports/{viewport_id:int}", dependencies=[VERSIONED])
def update_viewport(
    viewport_id: int,
    data: ViewportPatch,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
) -> ViewportOut:
    """Change a viewport; images move to the viewport of their time."""
    viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
    check_if_match(request, viewport.version)
    actions.update_viewport(session, access, viewport, data)
    set_etag(response, viewport.version)
    return _shown(session, [viewport])[0]


@router.delete("/viewports/{viewport_id:int}", status_code=204, dependencies=[VERSIONED])
def delete_viewport(
    viewport_id: int, request: Request, session: SessionDep, access: Registrar
) -> None:
    """Delete a viewport with its registrations and runs; it can be restored for 30 days."""
    viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
    if "if-match" in request.headers:
        check_if_match(request, viewport.version)
    actions.delete_viewport(session, access, viewport)


@router.get("/viewports/{viewport_id:int}/keypoints")
def get_keypoints(
    viewport_id: int, session: SessionDep, access: Reader, response: Response
) -> Page[KeypointOut]:
    """Show all keypoints of a viewport; the ETag is the viewport's."""
    viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
    set_etag(response, viewport.version)
    keypoints = service.keypoints_of(session, viewport.id)
    return Page(items=[KeypointOut.of(keypoint) for keypoint in keypoints])


@router.put("/viewports/{viewport_id:int}/keypoints", dependencies=[VERSIONED])
def replace_keypoints(
    viewport_id: int,
    data: KeypointsBody,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
) -> Page[KeypointOut]:
    """Replace all keypoints; the first set needs no If-Match, replacing one does."""
    viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
    if "if-match" in request.headers or service.keypoints_of(session, viewport.id):
        check_if_match(request, viewport.version)
    keypoints = actions.replace_keypoints(session, access, viewport, data)
    set_etag(response, viewport.version)
    return Page(items=[KeypointOut.of(keypoint) for keypoint in keypoints])


@router.post("/viewports/{viewport_id:int}/registrations", status_code=201, tags=["registrations"])
def register_viewport(
    viewport_id: int,
    asked: RegistrationIn,
    database: DatabaseDep,
    session: SessionDep,
    access: Registrar,
) -> RegistrationOut:
    """Register a viewport by its keypoints, or by a pose that is known."""
    return RegistrationOut.of(actions.register(database, session, access, viewport_id, asked))


@router.post("/viewports/{viewport_id:int}/solve", tags=["registrations"])
def solve_viewport(
    viewport_id: int, data: SolveIn, database: DatabaseDep, access: Reader
) -> SolveOut:
    """Solve keypoints by all methods and draw what follows; nothing is stored."""
    with database.reading() as session:
        viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
        preview = preview_of(session, viewport, data)
    return solve_preview(preview, data)


@router.get("/viewports/{viewport_id:int}/registrations", tags=["registrations"])
def list_registrations(
    viewport_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Page[RegistrationOut]:
    """List a viewport's registrations, oldest first; a run takes the newest with a pose."""
    viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
    registrations, next_cursor = service.list_registrations(session, viewport.id, paging)
    return Page(
        items=[RegistrationOut.of(registration) for registration in registrations],
        next_cursor=next_cursor,
    )


def _shown(session: SessionDep, viewports: Sequence[Viewport]) -> list[ViewportOut]:
    ids = [viewport.id for viewport in viewports]
    counts = service.keypoint_counts(session, ids)
    current = service.current_registrations(session, ids)
    return [
        ViewportOut.of(
            viewport,
            counts.get(viewport.id, 0),
            current[viewport.id].id if viewport.id in current else None,
        )
        for viewport in viewports
    ]
