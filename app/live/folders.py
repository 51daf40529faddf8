"""Watched folders: what is in them, and what became of each file.

A file is taken when it has not changed between two looks, so that nothing is read while it is
written. What became of it is remembered by name, size and time of change: a folder may be left as
it is, and a worker that begins anew reads nothing twice. With `moves_files` a file goes to `done`
or `failed` below the folder.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import now
from app.errors import Conflict, Invalid, NotFound
from app.live import repository
from app.live.known_file import KnownFile
from app.tables.live import WatchedFile, WatchedFolder
from app.tables.sites import Camera

LEASE_PREFIX = "folder"
ENDINGS = frozenset({".jpg", ".jpeg", ".png", ".webp"})
DONE, FAILED = "done", "failed"


def add(session: Session, camera: Camera, path: str, *, moves_files: bool) -> WatchedFolder:
    """Have the workers watch a folder. Raises Invalid (path), Conflict (watched already)."""
    place = Path(path)
    if not place.is_absolute() or ".." in place.parts or "\x00" in path:
        raise Invalid.field("path", "must be a whole path, such as /srv/cameras/gable")
    row = WatchedFolder(camera_id=camera.id, path=str(place), moves_files=moves_files)
    session.add(row)
    try:
        session.flush()
    except sa.exc.IntegrityError as error:
        raise Conflict(f"{path} is watched for this camera already") from error
    return row


def get(session: Session, folder_id: int) -> WatchedFolder:
    """Return a watched folder. Raises NotFound."""
    row = repository.folder(session, folder_id)
    if row is None:
        raise NotFound("there is no such watched folder")
    return row


def of_camera(session: Session, camera_id: int) -> Sequence[WatchedFolder]:
    """Return a camera's watched folders."""
    return repository.folders(session, camera_id)


def set_paused(session: Session, row: WatchedFolder, *, paused: bool) -> None:
    """Pause or go on."""
    row.paused_at = now() if paused else None
    session.flush()


def counts(session: Session, folder_id: int) -> Mapping[str, int]:
    """Count a folder's files by what became of them."""
    return repository.file_counts(session, folder_id)


def refused(session: Session, folder_id: int) -> Sequence[WatchedFile]:
    """Return the newest files that were refused, with the reason."""
    return repository.refused(session, folder_id, 10)


def wanted(session: Session) -> Mapping[int, int]:
    """Return the folders to watch, each with its version."""
    return repository.watched(session)


def noted(session: Session, folder_id: int, trouble: str | None) -> None:
    """Say that a folder was looked at, and what was in the way."""
    repository.folder_noted(session, folder_id, now(), trouble)


def known_files(session: Session, folder_id: int) -> Mapping[str, KnownFile]:
    """Return what is known of a folder's files, by path below it."""
    return repository.files(session, folder_id)


def remember(session: Session, folder_id: int, seen: Mapping[str, KnownFile]) -> None:
    """Keep what became of some files, by path below the folder."""
    repository.remember(session, folder_id, seen, now())
