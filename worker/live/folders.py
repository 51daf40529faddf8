"""The loop of a watched folder: look, take what has stopped growing, remember it, look again."""

import threading
from dataclasses import dataclass
from pathlib import Path

import structlog
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database, now
from app.errors import AppError, StorageFull
from app.imagery.service import Upload, store_image
from app.live import folders
from app.storage import Storage
from app.tables.live import WatchedFile, WatchedFileStatus, WatchedFolder
from worker.leases import Held, confirm

log = structlog.get_logger()
LOOK_EVERY_S = 2.0
FULL_PAUSE_S = 15.0


@dataclass(frozen=True, slots=True)
class Seen:
    """A file as it is now: its path below the folder, size and time of change."""

    path: str
    size_bytes: int
    modified_ns: int


class FolderLoops:
    """What the supervisor runs for watched folders (see worker/loops.py)."""

    name = folders.LEASE_PREFIX

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._settings = settings
        self._storage = Storage(settings.storage_url)

    def wanted(self, session: Session) -> dict[int, int]:
        """Return the folders that are not paused, each with its version."""
        return dict(folders.wanted(session))

    def run(self, item_id: int, lease: Held, stop: threading.Event) -> None:
        """Watch a folder until told to stop."""
        while True:
            pause_s = self.look(item_id, lease, stop)
            if stop.wait(pause_s):
                return

    def look(self, folder_id: int, lease: Held, stop: threading.Event) -> float:
        """Look once; returns how long to wait before the next look."""
        with self._database.reading() as session:
            folder = folders.get(session, folder_id)
            known = dict(folders.known_files(session, folder_id))
        trouble: str | None = None
        pause_s = LOOK_EVERY_S
        try:
            for seen in _files_in(Path(folder.path), moves=folder.moves_files):
                if stop.is_set():
                    break
                self._see(folder, seen, known.get(seen.path), lease)
        except StorageFull as error:
            # What is in the folder waits there until there is room.
            trouble, pause_s = error.detail, FULL_PAUSE_S
        except OSError as error:
            trouble = f"the folder cannot be read: {error.strerror}"
        self._note(folder_id, lease, trouble)
        return pause_s

    def _see(
        self, folder: WatchedFolder, seen: Seen, before: WatchedFile | None, lease: Held
    ) -> None:
        is_same = before is not None and (before.size_bytes, before.modified_ns) == (
            seen.size_bytes,
            seen.modified_ns,
        )
        if is_same and before is not None and before.status is not WatchedFileStatus.WAITING:
            return
        status, reason = WatchedFileStatus.WAITING, None
        if is_same:
            status, reason = self._take(folder, seen)
        self._remember(folder.id, seen, status, reason, lease)
        if folder.moves_files and status is not WatchedFileStatus.WAITING:
            _move(Path(folder.path), seen.path, refused=status is WatchedFileStatus.REFUSED)

    def _take(self, folder: WatchedFolder, seen: Seen) -> tuple[WatchedFileStatus, str | None]:
        with (Path(folder.path) / seen.path).open("rb") as stream:
            data = stream.read(self._settings.max_upload_bytes + 1)
        upload = Upload(data, Path(seen.path).name)
        try:
            _, is_new = store_image(
                self._database, self._storage, self._settings, folder.camera_id, upload
            )
        except StorageFull:
            raise
        except AppError as error:
            return WatchedFileStatus.REFUSED, error.detail
        return (WatchedFileStatus.TAKEN if is_new else WatchedFileStatus.KNOWN), None

    def _remember(
        self,
        folder_id: int,
        seen: Seen,
        status: WatchedFileStatus,
        reason: str | None,
        lease: Held,
    ) -> None:
        with self._database.writing() as session:
            confirm(session, lease)
            row = folders.known_files(session, folder_id).get(seen.path)
            if row is None:
                row = WatchedFile(folder_id=folder_id, path=seen.path)
                session.add(row)
            row.size_bytes, row.modified_ns = seen.size_bytes, seen.modified_ns
            row.status, row.reason, row.seen_at = status, reason, now()

    def _note(self, folder_id: int, lease: Held, trouble: str | None) -> None:
        with self._database.writing() as session:
            confirm(session, lease)
            folders.noted(session, folder_id, trouble)


def _files_in(folder: Path, *, moves: bool) -> list[Seen]:
    """Return the photographs below a folder, also in subfolders; links are not followed."""
    if not folder.is_dir():
        raise NotADirectoryError(20, "there is no such folder on the worker's machine")
    kept_apart = {folders.DONE, folders.FAILED} if moves else set()
    found = []
    for path in sorted(folder.rglob("*")):
        inner = path.relative_to(folder)
        wanted = path.suffix.lower() in folders.ENDINGS and inner.parts[0] not in kept_apart
        if wanted and path.is_file() and not path.is_symlink() and not path.name.startswith("."):
            stat = path.stat()
            found.append(Seen(inner.as_posix(), stat.st_size, stat.st_mtime_ns))
    return found


def _move(folder: Path, inner: str, *, refused: bool) -> None:
    target = folder / (folders.FAILED if refused else folders.DONE) / inner
    target.parent.mkdir(parents=True, exist_ok=True)
    (folder / inner).replace(target)
