"""What callers do with viewports: the permission, the change and the audit line together."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.db import Database
from app.deletions import actions as deletions
from app.registration import service
from app.registration.schemas import KeypointsIn, RegistrationIn, ViewportIn, ViewportPatch
from app.registration.solving import solve
from app.sites import actions as sites
from app.tables.registration import Keypoint, Registration
from app.tables.sites import Viewport


def viewport_for(session: Session, access: Access, scope: Scope, viewport_id: int) -> Viewport:
    """Return a viewport on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    viewport = service.get_viewport(session, viewport_id)
    access.require(scope, viewport.camera.site_id)
    return viewport


def create_viewport(session: Session, access: Access, data: ViewportIn) -> Viewport:
    """Make a viewport of a camera the caller may register."""
    camera = sites.camera_for(session, access, Scope.REGISTER, data.camera_id)
    viewport = service.create_viewport(session, data)
    record(session, access, "create", "viewport", viewport.id, camera.site_id, name=viewport.name)
    return viewport


def update_viewport(
    session: Session, access: Access, viewport: Viewport, data: ViewportPatch
) -> Viewport:
    """Change a viewport."""
    service.update_viewport(session, viewport, data)
    changes = data.model_dump(mode="json", exclude_unset=True)
    site_id = viewport.camera.site_id
    record(session, access, "update", "viewport", viewport.id, site_id, changes=changes)
    return viewport


def delete_viewport(session: Session, access: Access, viewport: Viewport) -> None:
    """Delete a viewport with its keypoints, registrations and runs, for 30 days."""
    site_id = viewport.camera.site_id
    deletions.delete(session, access, "viewport", viewport.id, site_id, viewport.name)


def replace_keypoints(
    session: Session, access: Access, viewport: Viewport, data: KeypointsIn
) -> Sequence[Keypoint]:
    """Replace all keypoints of a viewport."""
    keypoints = service.replace_keypoints(session, viewport, data)
    site_id = viewport.camera.site_id
    count = len(keypoints)
    record(session, access, "replace", "keypoints", viewport.id, site_id, count=count)
    return keypoints


def register(
    database: Database, session: Session, access: Access, viewport_id: int, asked: RegistrationIn
) -> Registration:
    """Register a viewport; `session` is not touched before the solution is there."""
    with database.reading() as reading:
        viewport = viewport_for(reading, access, Scope.REGISTER, viewport_id)
        site_id = viewport.camera.site_id
        problem = service.problem_of(reading, viewport)
    registration = solve(problem, asked)
    registration.created_by_id = access.user_id
    service.keep(session, registration)
    method = registration.method.value
    record(session, access, "create", "registration", registration.id, site_id, method=method)
    return registration
