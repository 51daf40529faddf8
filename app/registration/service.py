"""Viewports, their keypoints and their registrations, for whoever may (see actions.py)."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from app.db import Database
from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame
from app.edits import flush_named
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.imagery import service as imagery
from app.paging import Paging
from app.registration import conversion, repository
from app.registration import keypoints as keypoint_sets
from app.registration.schemas import KeypointsIn, RegistrationIn, ViewportIn, ViewportPatch
from app.registration.solving import Problem, solve
from app.sites import service as sites
from app.sites.fields import in_zone
from app.tables.registration import Keypoint, Registration
from app.tables.sites import Camera as CameraRow
from app.tables.sites import Viewport

NO_REGISTRATION = "there is no such registration"


def get_viewport(session: Session, viewport_id: int) -> Viewport:
    """Return a viewport. Raises NotFound."""
    viewport = repository.viewport(session, viewport_id)
    if viewport is None:
        raise NotFound(sites.NO_VIEWPORT)
    return viewport


def list_viewports(
    session: Session,
    site_ids: frozenset[int] | None,
    paging: Paging,
    *,
    camera_id: int | None = None,
    site_id: int | None = None,
) -> tuple[Sequence[Viewport], str | None]:
    """Return a page of the viewports of the sites `site_ids` (None: all)."""
    return repository.viewports(session, site_ids, camera_id, site_id, paging)


def create_viewport(session: Session, data: ViewportIn) -> Viewport:
    """Make a viewport and give it the camera's images of its time.

    Raises NotFound (camera), Conflict (name, overlap), Invalid (an empty range).
    """
    camera = sites.get_camera(session, data.camera_id)
    viewport = Viewport(
        camera_id=camera.id,
        name=data.name,
        valid_from=_moment(data.valid_from, camera, "valid_from"),
        valid_until=_moment(data.valid_until, camera, "valid_until"),
    )
    session.add(viewport)
    _settle_times(session, viewport, camera)
    return viewport


def update_viewport(session: Session, viewport: Viewport, data: ViewportPatch) -> Viewport:
    """Change a viewport; images move to where they now belong. Raises as `create_viewport`."""
    if data.name is not None:
        viewport.name = data.name
    for field in ("valid_from", "valid_until"):
        if field in data.model_fields_set:
            moment = _moment(getattr(data, field), viewport.camera, field)
            setattr(viewport, field, moment)
    _settle_times(session, viewport, viewport.camera)
    return viewport


def _moment(moment: datetime | None, camera: CameraRow, field: str) -> datetime | None:
    return None if moment is None else in_zone(moment, camera.timezone, field)


def _settle_times(session: Session, viewport: Viewport, camera: CameraRow) -> None:
    begin, end = viewport.valid_from, viewport.valid_until
    if begin is not None and end is not None and begin >= end:
        raise Invalid.field("valid_until", "must come after valid_from")
    with session.no_autoflush:
        sites.lock_camera(session, camera.id)
        other = repository.overlapping(session, camera.id, viewport.id, begin, end)
    if other is not None:
        begin_words = _words(other.valid_from, "ever")
        end_words = _words(other.valid_until, "further notice")
        message = (
            f"overlaps with viewport {other.name!r} (id {other.id}), valid from {begin_words} "
            f"until {end_words}; a camera points one way at a time, so end that one first or "
            "choose other times"
        )
        raise Conflict(f"it {message}", fields=(FieldError("valid_from", message),))
    flush_named(session, f"this camera already has a viewport named {viewport.name!r}")
    imagery.assign_viewports(session, camera.id)


def _words(moment: datetime | None, otherwise: str) -> str:
    return otherwise if moment is None else f"{moment:%Y-%m-%d %H:%M:%S} UTC"


def keypoints_of(session: Session, viewport_id: int) -> Sequence[Keypoint]:
    """Return a viewport's keypoints."""
    return repository.keypoints(session, viewport_id)


def keypoint_counts(session: Session, viewport_ids: Sequence[int]) -> dict[int, int]:
    """Count the keypoints of viewports."""
    return repository.keypoint_counts(session, viewport_ids)


def replace_keypoints(
    session: Session, viewport: Viewport, data: KeypointsIn
) -> Sequence[Keypoint]:
    """Replace all keypoints of a viewport. Raises Invalid naming each wrong one."""
    return keypoint_sets.replace(session, viewport, data)


def problem_of(session: Session, viewport: Viewport) -> Problem:
    """Read what there is to solve for a viewport."""
    return Problem(
        viewport_id=viewport.id,
        frame=conversion.frame_of(viewport.camera.site),
        water_level_m=viewport.camera.site.water_level_m,
        intrinsics=conversion.intrinsics_of(viewport.camera),
        keypoints=repository.keypoints(session, viewport.id),
    )


def keep(session: Session, registration: Registration) -> Registration:
    """Store a solved registration."""
    session.add(registration)
    session.flush()
    return registration


def register(database: Database, viewport_id: int, asked: RegistrationIn) -> Registration:
    """Register a viewport: read, solve, store. Raises NotFound, Invalid."""
    with database.reading() as session:
        problem = problem_of(session, get_viewport(session, viewport_id))
    registration = solve(problem, asked)
    with database.writing() as session:
        return keep(session, registration)


def list_registrations(
    session: Session, viewport_id: int, paging: Paging
) -> tuple[Sequence[Registration], str | None]:
    """Return a page of a viewport's registrations, oldest first."""
    return repository.registrations(session, viewport_id, paging)


def newest_by_method(session: Session, viewport_id: int) -> Sequence[Registration]:
    """Return a viewport's newest registration of each method, newest first."""
    return repository.newest_by_method(session, viewport_id)


def current_registrations(session: Session, viewport_ids: Sequence[int]) -> dict[int, Registration]:
    """Return, by viewport, the newest registration with a camera pose: the one a run uses."""
    return repository.newest_poses(session, viewport_ids)


def camera_of(session: Session, registration_id: int) -> tuple[Camera, EnuFrame]:
    """Return a registration's camera in its site's ENU frame, and that frame.

    The intrinsics are those the registration was solved with. Raises NotFound, and Conflict for a
    homography, which is no camera.
    """
    registration = repository.registration(session, registration_id)
    if registration is None:
        raise NotFound(NO_REGISTRATION)
    frame = conversion.frame_of(registration.viewport.camera.site)
    camera = conversion.camera_of(registration, frame)
    if camera is None:
        raise Conflict("a homography has no camera pose; register the viewport by pnp or given")
    return camera, frame
