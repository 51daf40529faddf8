"""The loop of a watched folder: look, take what has stopped growing, remember it, look again."""

import threading
import time
from collections.abc import Mapping
from pathlib import Path

from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.errors import AppError, StorageFull
from app.imagery.service import Upload, store_image
from app.live import folders
from app.live.known_file import KnownFile
from app.storage import Storage
from app.tables.live import WatchedFileStatus, WatchedFolder
from worker.leases import Held, confirm

LOOK_EVERY_S = 2.0
FULL_PAUSE_S = 15.0
PAUSE_SHARE = 10.0  # times as long as looking took
LONGEST_PATH = 1000


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
            known = folders.known_files(session, folder_id)
        trouble: str | None = None
        pause_s = LOOK_EVERY_S
        try:
            begun = time.monotonic()
            there, trouble = _files_in(Path(folder.path), moves=folder.moves_files)
            # A folder with years of files is not looked through all the time.
            pause_s = max(pause_s, PAUSE_SHARE * (time.monotonic() - begun))
            trouble = self._see(folder, there, known, lease, stop) or trouble
        except StorageFull as error:
            # What is in the folder waits there until there is room.
            trouble, pause_s = error.detail, FULL_PAUSE_S
        except OSError as error:
            trouble = f"the folder cannot be read: {error.strerror}"
        with self._database.writing() as session:
            confirm(session, lease)
            folders.noted(session, folder_id, trouble)
        return pause_s

    def _see(
        self,
        folder: WatchedFolder,
        there: Mapping[str, KnownFile],
        known: Mapping[str, KnownFile],
        lease: Held,
        stop: threading.Event,
    ) -> str | None:
        """Note what is new or grows, take what has stopped growing; returns what was in the way."""
        trouble: str | None = None
        changed = {
            path: file for path, file in there.items() if not _is_same(file, known.get(path))
        }
        self._remember(folder.id, changed, lease)
        for path in (path for path in there if path not in changed):
            if stop.is_set():
                break
            file = known[path]
            try:
                if file.status is WatchedFileStatus.WAITING:
                    status, reason = self._take(folder, path)
                    file = file._replace(status=status, reason=reason)
                    self._remember(folder.id, {path: file}, lease)
                if folder.moves_files:
                    _move(Path(folder.path), path, refused=file.status is WatchedFileStatus.REFUSED)
            except FileNotFoundError:
                continue  # somebody took it away meanwhile
            except OSError as error:
                # One that cannot be read keeps no other from being taken.
                trouble = f"{path}: {error.strerror}"
        return trouble

    def _take(self, folder: WatchedFolder, path: str) -> tuple[WatchedFileStatus, str | None]:
        with (Path(folder.path) / path).open("rb") as stream:
            data = stream.read(self._settings.max_upload_bytes + 1)
        upload = Upload(data, Path(path).name)
        try:
            _, is_new = store_image(
                self._database, self._storage, self._settings, folder.camera_id, upload
            )
        except StorageFull:
            raise
        except AppError as error:
            return WatchedFileStatus.REFUSED, error.detail
        return (WatchedFileStatus.TAKEN if is_new else WatchedFileStatus.KNOWN), None

    def _remember(self, folder_id: int, seen: Mapping[str, KnownFile], lease: Held) -> None:
        if not seen:
            return
        with self._database.writing() as session:
            confirm(session, lease)
            folders.remember(session, folder_id, seen)


def _is_same(file: KnownFile, before: KnownFile | None) -> bool:
    return before is not None and before[:2] == file[:2]


def _files_in(folder: Path, *, moves: bool) -> tuple[dict[str, KnownFile], str | None]:
    """Return the photographs below a folder by path, also in subfolders; links are not followed.

    And what keeps one from being taken whose name cannot be kept.
    """
    if not folder.is_dir():
        raise NotADirectoryError(20, "there is no such folder on the worker's machine")
    kept_apart = {folders.DONE, folders.FAILED} if moves else set()
    found: dict[str, KnownFile] = {}
    trouble = None
    for path in sorted(folder.rglob("*")):
        inner = path.relative_to(folder)
        wanted = path.suffix.lower() in folders.ENDINGS and inner.parts[0] not in kept_apart
        if not wanted or path.name.startswith(".") or path.is_symlink() or not path.is_file():
            continue
        name = inner.as_posix()
        if len(name) > LONGEST_PATH or name != name.encode(errors="ignore").decode():
            trouble = f"{name[:80]!a}: its name is too long, or not readable; rename it"
            continue
        try:
            stat = path.stat()
        except FileNotFoundError:
            continue
        found[name] = KnownFile(stat.st_size, stat.st_mtime_ns, WatchedFileStatus.WAITING)
    return found, trouble


def _move(folder: Path, inner: str, *, refused: bool) -> None:
    target = folder / (folders.FAILED if refused else folders.DONE) / inner
    target.parent.mkdir(parents=True, exist_ok=True)
    (folder / inner).replace(target)
