"""Files of a batch coming in: announced, sent whole or in pieces, checked and stored by content.

All slow work (checking, hashing, storing) comes before the first statement that writes. A file is
worth something only once its bytes are on the disk, so its row says so last; whatever breaks off
in between leaves a file that is still waited for. Files are read, checked and written one after
the other, so that only one is held however many are flushed together.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import IO, Any

from app import archives
from app.config import Settings
from app.db import Database
from app.errors import Invalid, TooLarge
from app.imports import paths, repository
from app.imports.contents import Content, read
from app.imports.schemas import FileIn
from app.imports.service import open_import
from app.storage import Storage
from app.storing_together import StoringTogether
from app.tables.imports import FileState, ImportFile

MOST_FILES = 200_000
ENTRIES = archives.Limits(0, entries=50_000).entries
PORTION_BYTES = 24 << 20
_FACTS = ("state", "reason", "sha256", "media_type", "width_px", "height_px", "exif_at")


@dataclass(frozen=True, slots=True)
class Place:
    """Where bytes are to be kept and what is taken: the parts that every step here needs."""

    database: Database
    storage: Storage
    settings: Settings


@dataclass(frozen=True, slots=True)
class Blob:
    """An announced file, and how its bytes are read once it is its turn."""

    file_id: int
    read: Callable[[], bytes]


def announce(place: Place, import_id: int, sent: Sequence[FileIn]) -> list[ImportFile]:
    """Note files that are to come; returns them as they stand, in the order they were sent.

    What is not wanted, or known by the hash that was sent, is not waited for.
    """
    with place.database.writing() as session:
        batch = open_import(session, import_id)
        keys = [paths.path_key(file.path) for file in sent]
        present = repository.files_by_key(session, import_id, keys)
        if repository.count_files(session, import_id) + len(sent) > MOST_FILES + len(present):
            raise TooLarge(f"an import takes at most {MOST_FILES:,} files; begin another one")
        hashes = [file.sha256 for file in sent if file.sha256]
        known = repository.hashes_of(session, batch.camera_id, hashes)
        fresh = [
            _announced(place.settings, import_id, key, file, known)
            for key, file in zip(keys, sent, strict=True)
            if key not in present
        ]
        for key, file in zip(keys, sent, strict=True):
            if key in present and _has_changed(present[key], file):
                repository.forget_entries(session, present[key])
                _begin_anew(present[key], _announced(place.settings, import_id, key, file, known))
        repository.add_files(session, fresh)
        session.flush()
        found = repository.files_by_key(session, import_id, keys)
        return [found[key] for key in keys]


def _announced(
    settings: Settings, import_id: int, key: str, file: FileIn, known: set[str]
) -> dict[str, Any]:
    state, reason = _first_state(settings, file, known)
    return {
        "import_id": import_id,
        "path": paths.shown(file.path),
        "path_key": key,
        "size_bytes": file.size_bytes,
        "received_bytes": 0,
        "modified_at": file.modified_at,
        "state": state,
        "reason": reason,
        "sha256": file.sha256 if state is FileState.KNOWN else None,
    }


def _first_state(settings: Settings, file: FileIn, known: set[str]) -> tuple[FileState, str | None]:
    if paths.is_litter(file.path):
        return FileState.SKIPPED, None
    if file.sha256 in known:
        return FileState.KNOWN, None
    if not file.size_bytes:
        return FileState.REFUSED, "is empty"
    reason = _unwanted(file.path)
    limit = settings.max_archive_bytes if paths.is_archive(file.path) else settings.max_upload_bytes
    if reason is None and file.size_bytes > limit:
        reason = f"is larger than {limit:,} bytes"
    return (FileState.REFUSED, reason) if reason else (FileState.WAITING, None)


def _unwanted(path: str) -> str | None:
    """Return why a file is not worth sending, by its name's ending; None where it may be."""
    name = path.rpartition("/")[2]
    ending = name.rpartition(".")[2] if "." in name else ""
    if not ending or paths.is_photograph(name) or paths.is_archive(name) or not ending.isalnum():
        return None
    return f"is no photograph by its name (.{ending[:12]}); taken are JPEG, PNG, WebP and zip"


def _has_changed(present: ImportFile, file: FileIn) -> bool:
    is_same_time = file.modified_at is None or present.modified_at == file.modified_at
    return present.size_bytes != file.size_bytes or not is_same_time


def _begin_anew(present: ImportFile, values: dict[str, Any]) -> None:
    for name, value in values.items():
        setattr(present, name, value)
    present.media_type = present.width_px = present.height_px = present.exif_at = None


def stage(place: Place, import_id: int, blobs: Sequence[Blob]) -> list[dict[str, Any]]:
    """Check and store the bytes of announced files, and note what they are; returns what changed.

    Raises StorageFull with all of them still waited for, Conflict for a batch that is closed.
    """
    with StoringTogether(place.storage) as together:
        changes = [{**_taken(place, together, blob.read()), "id": blob.file_id} for blob in blobs]
        together.settle()
    with place.database.writing() as session:
        open_import(session, import_id)
        repository.update_files(session, changes)
    return changes


def _taken(place: Place, together: StoringTogether, data: bytes) -> dict[str, Any]:
    """Check bytes and store them if they are a photograph; returns what they turned out to be."""
    content = read(data, place.settings.max_image_pixels)
    if isinstance(content, Content):
        together.add(content.sha256, data)
    return _facts(content) | {"received_bytes": len(data)}


def _facts(content: Content | str) -> dict[str, Any]:
    if isinstance(content, str):
        return dict.fromkeys(_FACTS) | {"state": FileState.REFUSED, "reason": content}
    exif_at = content.exif_at.isoformat() if content.exif_at else None
    return {
        "state": FileState.STAGED,
        "reason": None,
        "sha256": content.sha256,
        "media_type": content.media_type,
        "width_px": content.width_px,
        "height_px": content.height_px,
        "exif_at": exif_at,
    }


def unpack(place: Place, import_id: int, archive: ImportFile, stream: IO[bytes]) -> None:
    """Take all photographs of an archive in, or none.

    Raises TooLarge and Invalid for an archive that is hostile or damaged; it is then refused.
    """
    with StoringTogether(place.storage) as together:
        try:
            rows = list(_entries(place, together, archive, stream))
        except (TooLarge, Invalid) as error:
            refuse(place, import_id, archive.id, error.detail.removeprefix("file: "))
            raise
        together.settle()
    with place.database.writing() as session:
        open_import(session, import_id)
        if repository.count_files(session, import_id) + len(rows) > MOST_FILES:
            raise TooLarge(f"an import takes at most {MOST_FILES:,} files; begin another one")
        for begin in range(0, len(rows), 1_000):
            repository.add_files(session, rows[begin : begin + 1_000])
        done = {"id": archive.id, "state": FileState.UNPACKED}
        repository.update_files(session, [done | {"received_bytes": archive.size_bytes}])


def refuse(place: Place, import_id: int, file_id: int, reason: str) -> None:
    """Note why a file is not taken."""
    with place.database.writing() as session:
        open_import(session, import_id)
        row = {"id": file_id, "state": FileState.REFUSED, "reason": reason, "received_bytes": 0}
        repository.update_files(session, [row])


def _entries(
    place: Place, together: StoringTogether, archive: ImportFile, stream: IO[bytes]
) -> Iterator[dict[str, Any]]:
    """Yield the row of every file in an archive, and take the bytes of photographs."""
    passed_over: list[str] = []
    longest_bytes = place.settings.max_upload_bytes
    limits = archives.Limits(place.settings.max_archive_bytes, entries=ENTRIES)
    for number, (name, entry) in enumerate(archives.entries(stream, limits, passed_over)):
        base = _base(archive, name, number)
        unwanted = _unwanted_entry(name)
        if unwanted is not None:
            yield base | unwanted
            continue
        data = entry.read(longest_bytes + 1)
        if len(data) > longest_bytes:
            reason = f"is larger than {longest_bytes:,} bytes"
            yield base | dict.fromkeys(_FACTS) | {"state": FileState.REFUSED, "reason": reason}
            continue
        yield base | _taken(place, together, data) | {"size_bytes": len(data)}
    for number, name in enumerate(passed_over):
        base = _base(archive, name, -1 - number)
        yield base | dict.fromkeys(_FACTS) | {"state": FileState.SKIPPED}


def _base(archive: ImportFile, name: str, number: int) -> dict[str, Any]:
    """Return an entry's row; its number in the archive keeps entries of one name apart."""
    path = f"{archive.path}/{name}"
    return {
        "import_id": archive.import_id,
        "path": paths.shown(path),
        "path_key": paths.path_key(f"{path}\0{number}"),
        "size_bytes": 0,
        "received_bytes": 0,
        "modified_at": None,
    }


def _unwanted_entry(name: str) -> dict[str, Any] | None:
    nothing = dict.fromkeys(_FACTS)
    if paths.is_litter(name):
        return nothing | {"state": FileState.SKIPPED}
    reason = _unwanted(name)
    return None if reason is None else nothing | {"state": FileState.REFUSED, "reason": reason}
