"""Bytes of announced files as they come over the network: many small ones at once, or pieces.

A pack is the bytes of several files one behind the other, because thousands of small requests cost
more than the photographs in them. A large file comes in pieces, each with the place it begins at;
after a lost connection the row of the file says from where to go on.
"""

from collections.abc import Sequence
from functools import partial

from app.errors import Conflict, Invalid, NotFound, TooLarge
from app.imports import intake, paths, repository
from app.imports.intake import Blob, Place
from app.imports.octets import Octets
from app.imports.parts import Parts
from app.imports.service import get, open_import
from app.tables.imports import FileState, ImportFile

MOST_IN_A_PACK = 500
NO_FILE = "there is no such file in this import; announce it first"


def receive_pack(
    place: Place, import_id: int, file_ids: Sequence[int], body: Octets
) -> list[ImportFile]:
    """Take whole photographs, their bytes one behind the other in the order of the ids.

    Raises Invalid when the bytes are not as many as were announced; then nothing is taken.
    """
    wanted = _files(place, import_id, file_ids)
    if body.size_bytes != sum(file.size_bytes for file in wanted):
        raise Invalid.field(
            "files",
            f"the pack has {body.size_bytes} bytes, but these files announced another number",
        )
    if any(paths.is_archive(file.path) for file in wanted):
        raise Invalid.field("files", "an archive is sent by itself, in pieces")
    blobs: list[Blob] = []
    at = 0
    for file in wanted:
        # What came once is not stored twice: a lost answer is no lost work.
        if file.state is FileState.WAITING:
            blobs.append(Blob(file.id, partial(body.part, at, at + file.size_bytes)))
        at += file.size_bytes
    _stage(place, import_id, wanted, blobs)
    return wanted


def receive_piece(
    place: Place, import_id: int, file_id: int, offset: int, body: Octets
) -> ImportFile:
    """Take a piece of a file; with its last one the file is checked, an archive unpacked.

    Raises Conflict, telling `received_bytes`, for a piece that does not continue what is here;
    TooLarge and Invalid for an archive that is refused.
    """
    (file,) = _files(place, import_id, [file_id])
    if file.state is not FileState.WAITING:
        return file
    if offset != file.received_bytes:
        raise Conflict(
            f"{file.received_bytes} bytes of this file are here; go on from there",
            more={"received_bytes": file.received_bytes},
        )
    reached = offset + body.size_bytes
    if not body.size_bytes or reached > file.size_bytes:
        raise Invalid.field("offset", f"the file was announced with {file.size_bytes} bytes")
    if body.size_bytes == file.size_bytes and not paths.is_archive(file.path):
        # Nothing to put together: it need not be written, flushed and read as a piece first.
        _stage(place, import_id, [file], [Blob(file.id, body.whole)])
        return file
    parts = Parts(place.settings.storage_url)
    parts.put(import_id, file_id, offset, body.whole())
    if reached < file.size_bytes:
        with place.database.writing() as session:
            open_import(session, import_id)
            repository.update_files(session, [{"id": file_id, "received_bytes": reached}])
    else:
        _finish(place, parts, file)
    return _files(place, import_id, [file_id])[0]


def ids_of(text: str) -> list[int]:
    """Return ids that stand with commas between. Raises Invalid."""
    parts = text.split(",")
    if not all(part.isascii() and part.isdigit() and len(part) < 10 for part in parts):
        raise Invalid.field("files", "must be ids with commas between, such as 1,2,3")
    ids = [int(part) for part in parts]
    if len(ids) > MOST_IN_A_PACK or len(ids) != len(set(ids)):
        raise Invalid.field("files", f"must be up to {MOST_IN_A_PACK} ids, each once")
    return ids


def _stage(
    place: Place, import_id: int, files: Sequence[ImportFile], blobs: Sequence[Blob]
) -> None:
    """Take blobs in, and let the rows that were read before tell what became of them."""
    if not blobs:
        return
    by_id = {file.id: file for file in files}
    for change in intake.stage(place, import_id, blobs):
        for name, value in change.items():
            setattr(by_id[change["id"]], name, value)


def _finish(place: Place, parts: Parts, file: ImportFile) -> None:
    try:
        with parts.open(file.import_id, file.id, file.size_bytes) as stream:
            if paths.is_archive(file.path):
                intake.unpack(place, file.import_id, file, stream)
            else:
                intake.stage(place, file.import_id, [Blob(file.id, stream.read)])
    except NotFound:
        parts.remove(file.import_id, file.id)
        with place.database.writing() as session:
            repository.update_files(session, [{"id": file.id, "received_bytes": 0}])
        raise
    except (TooLarge, Invalid):
        parts.remove(file.import_id, file.id)
        raise
    parts.remove(file.import_id, file.id)


def _files(place: Place, import_id: int, file_ids: Sequence[int]) -> list[ImportFile]:
    with place.database.reading() as session:
        get(session, import_id)
        found = repository.files(session, import_id, file_ids)
    missing = [file_id for file_id in file_ids if file_id not in found]
    if missing:
        raise NotFound(NO_FILE)
    return [found[file_id] for file_id in file_ids]
