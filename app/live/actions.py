"""What callers do with live cameras: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth import service as auth
from app.auth.access import Access, Scope
from app.auth.audit import record
from app.deletions import service as deletions
from app.errors import looked_up_by
from app.live import folders, standing
from app.live.schemas import FolderIn, StandingIn
from app.registration import actions as registration
from app.sites import actions as sites
from app.tables.identity import ApiToken
from app.tables.live import StandingRun, WatchedFolder
from app.tables.sites import Camera

_USUAL_DAYS = 365


def make_drop_token(
    session: Session, access: Access, camera: Camera, days: int | None = None
) -> tuple[ApiToken, str]:
    """Make a token that does nothing but drop photographs of a camera: a year long, or as told."""
    name = f"drop for {camera.name}"[:200]
    token, text = auth.create_token(
        session, access, name=name, scopes=[Scope.INGEST], days=days, usual_days=_USUAL_DAYS
    )
    token.camera_id = camera.id
    session.flush()
    return token, text


def add_folder(session: Session, access: Access, camera_id: int, data: FolderIn) -> WatchedFolder:
    """Watch a folder. It names files of the server, so it takes an administrator of all sites."""
    camera = sites.camera_for(session, access, Scope.INGEST, camera_id)
    access.require(Scope.ADMIN, None)
    row = folders.add(session, camera, data.path, moves_files=data.moves_files)
    record(session, access, "watch", "folder", row.id, camera.site_id, path=row.path)
    return row


def folder_for(session: Session, access: Access, folder_id: int) -> WatchedFolder:
    """Return a watched folder on whose site the caller may ingest."""
    row = folders.get(session, folder_id)
    access.require(Scope.INGEST, row.camera.site_id)
    return row


def pause_folder(
    session: Session, access: Access, folder_id: int, *, paused: bool
) -> WatchedFolder:
    """Pause a folder, or watch it again."""
    row = folder_for(session, access, folder_id)
    folders.set_paused(session, row, paused=paused)
    act = "pause" if paused else "resume"
    record(session, access, act, "folder", row.id, row.camera.site_id)
    return row


def remove_folder(session: Session, access: Access, folder_id: int) -> None:
    """Watch a folder no longer; for 30 days it can be watched again as it was."""
    row = folder_for(session, access, folder_id)
    record(session, access, "forget", "folder", row.id, row.camera.site_id, path=row.path)
    deletions.delete(
        session,
        "watched_folder",
        [row.id],
        site_id=row.camera.site_id,
        label=row.path,
        user_id=access.user_id,
    )


def add_standing(session: Session, access: Access, data: StandingIn) -> StandingRun:
    """Have a viewport's images fused as they come."""
    with looked_up_by("viewport_id"):
        viewport = registration.viewport_for(session, access, Scope.INGEST, data.viewport_id)
    row = standing.add(
        session,
        viewport,
        name=data.name,
        detector=data.detector,
        preset=data.preset,
        parameters=data.parameters,
        ais_wait_s=data.ais_wait_s,
        user_id=access.user_id,
    )
    site_id = viewport.camera.site_id
    record(session, access, "start", "standing run", row.id, site_id, viewport=viewport.id)
    return row


def standing_for(session: Session, access: Access, standing_id: int) -> StandingRun:
    """Return a standing run on whose site the caller may ingest."""
    row = standing.get(session, standing_id)
    access.require(Scope.INGEST, row.viewport.camera.site_id)
    return row


def pause_standing(
    session: Session, access: Access, standing_id: int, *, paused: bool
) -> StandingRun:
    """Pause a standing run, or let it go on."""
    row = standing_for(session, access, standing_id)
    standing.set_paused(session, row, paused=paused)
    act = "pause" if paused else "resume"
    record(session, access, act, "standing run", row.id, row.viewport.camera.site_id)
    return row


def remove_standing(session: Session, access: Access, standing_id: int) -> None:
    """End a standing run; for 30 days it can be let go on."""
    row = standing_for(session, access, standing_id)
    record(session, access, "end", "standing run", row.id, row.viewport.camera.site_id)
    deletions.delete(
        session,
        "standing_run",
        [row.id],
        site_id=row.viewport.camera.site_id,
        label=row.name,
        user_id=access.user_id,
    )
