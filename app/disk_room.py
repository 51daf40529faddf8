"""How much room is left where data go, so that a filling disk is seen before it is full."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from app.config import Settings
from app.storage import Storage

SCARCE_BYTES = 2 << 30
SCARCE_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class Room:
    """What is free of a folder's disk, and how large the disk is, bytes."""

    folder: str
    device: int
    free_bytes: int
    total_bytes: int

    @property
    def is_scarce(self) -> bool:
        """Whether somebody should make room soon: a day of a busy camera takes about this much."""
        return self.free_bytes < min(SCARCE_BYTES, SCARCE_SHARE * self.total_bytes)


def rooms(settings: Settings, storage: Storage) -> dict[str, Room]:
    """Return the room for the database ("data") and, where they lie in a folder, for "files"."""
    folders = {"data": settings.data_dir}
    if storage.is_local:
        folders["files"] = Path(storage.root)
    found = {}
    for name, folder in folders.items():
        existing = next(each for each in (folder, *folder.resolve().parents) if each.exists())
        usage = shutil.disk_usage(existing)
        found[name] = Room(str(folder.resolve()), existing.stat().st_dev, usage.free, usage.total)
    return found


def scarce(settings: Settings, storage: Storage) -> list[Room]:
    """Return the disks where somebody should make room, each once."""
    found = {room.device: room for room in rooms(settings, storage).values() if room.is_scarce}
    return list(found.values())
