"""What callers do with batches: the permission, the change and the audit line together."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import BinaryIO

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.deletions import service as deletions
from app.edits import flush_edit
from app.errors import looked_up_by
from app.imports import intake, paths, receiving, service
from app.imports.intake import Place
from app.imports.octets import Octets
from app.imports.parts import Parts
from app.imports.schemas import FileIn, ImportIn, TimesTableOut
from app.imports.times import TimeSettings
from app.sites import actions as sites
from app.tables.imports import FileState, ImageImport, ImportFile

Check = Callable[[ImageImport], None]


def import_for(session: Session, access: Access, scope: Scope, import_id: int) -> ImageImport:
    """Return a batch on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    row = service.get(session, import_id)
    access.require(scope, row.site_id)
    return row


def start(
    place: Place,
    access: Access,
    wanted: ImportIn,
    files: Sequence[tuple[str, BinaryIO]] = (),
) -> ImageImport:
    """Begin a batch, with the files that came along; a refused archive leaves no batch behind."""
    with place.database.writing() as session, looked_up_by("camera_id"):
        camera = sites.camera_for(session, access, Scope.INGEST, wanted.camera_id)
        row = service.start(session, camera, wanted.name, access.user_id)
        record(session, access, "create", "import", row.id, row.site_id, name=row.name)
    try:
        _take(place, row.id, files)
    except BaseException:
        discard(place, access, row.id)
        raise
    return row


def _take(place: Place, import_id: int, sent: Sequence[tuple[str, BinaryIO]]) -> None:
    """Take in the files of a form: photographs in portions, because each flush costs."""
    if not sent:
        return
    announced = [
        FileIn(path=path, size_bytes=stream.seek(0, 2))
        for path, (_, stream) in zip(_apart([name for name, _ in sent]), sent, strict=True)
    ]
    files = intake.announce(place, import_id, announced)
    portion: list[intake.Blob] = []
    held_bytes = 0
    for file, (_, stream) in zip(files, sent, strict=True):
        if file.state is not FileState.WAITING:
            continue
        stream.seek(0)
        if paths.is_archive(file.path):
            intake.unpack(place, import_id, file, stream)
            continue
        portion.append(intake.Blob(file.id, stream.read))
        held_bytes += file.size_bytes
        if held_bytes >= intake.PORTION_BYTES:
            intake.stage(place, import_id, portion)
            portion, held_bytes = [], 0
    if portion:
        intake.stage(place, import_id, portion)


def _apart(names: Sequence[str]) -> list[str]:
    """Return paths for the files of a form, which may have one name several times.

    Forms tell no folders, and cameras begin to count anew in each: a name that comes again is
    taken as of a folder of its own.
    """
    seen: Counter[str] = Counter()
    found = []
    for name in names:
        seen[name] += 1
        found.append(name if seen[name] == 1 else f"{seen[name]}/{name}")
    return found


def announce(
    place: Place, access: Access, import_id: int, files: Sequence[FileIn]
) -> list[ImportFile]:
    """Note files that are to come."""
    _require(place, access, import_id)
    return intake.announce(place, import_id, files)


def receive_pack(
    place: Place, access: Access, import_id: int, file_ids: str, body: Octets
) -> list[ImportFile]:
    """Take whole photographs; the ids have commas between."""
    _require(place, access, import_id)
    return receiving.receive_pack(place, import_id, receiving.ids_of(file_ids), body)


def receive_piece(
    place: Place, access: Access, import_id: int, file_id: int, offset: int, body: Octets
) -> ImportFile:
    """Take a piece of a file."""
    _require(place, access, import_id)
    return receiving.receive_piece(place, import_id, file_id, offset, body)


def _require(place: Place, access: Access, import_id: int) -> None:
    with place.database.reading() as session:
        import_for(session, access, Scope.INGEST, import_id)
        service.open_import(session, import_id)


def set_times(session: Session, access: Access, row: ImageImport, times: TimeSettings) -> None:
    """Choose how a batch's files tell their times."""
    service.set_times(row, times)
    flush_edit(session)
    details = times.model_dump(mode="json")
    record(session, access, "set times", "import", row.id, row.site_id, **details)


def set_listed_times(
    session: Session, access: Access, row: ImageImport, text: str
) -> TimesTableOut:
    """Take a table of file names and times."""
    taken = service.set_listed_times(session, row, text)
    record(session, access, "set times", "import", row.id, row.site_id, listed=taken.matched)
    return taken


def commit(
    place: Place,
    access: Access,
    import_id: int,
    check: Check,
    *,
    leave_out_waiting: bool,
) -> ImageImport:
    """Make images of a batch; `check` compares the version that was looked at."""
    with place.database.reading() as session:
        row = import_for(session, access, Scope.INGEST, import_id)
        check(row)
        version, made = row.version, service.preview_of(session, row)
    with place.database.writing() as session:
        row = import_for(session, access, Scope.INGEST, import_id)
        check(row)
        if row.version != version:
            made = service.preview_of(session, row)
        service.commit(session, row, made, leave_out_waiting=leave_out_waiting)
        count = row.image_count
        record(session, access, "commit", "import", row.id, row.site_id, images=count)
    Parts(place.settings.storage_url).remove(import_id)
    return row


def discard(
    place: Place, access: Access, import_id: int, check: Check = lambda _: None
) -> ImageImport:
    """Give a batch up before it is committed, and its bytes with it.

    `check` compares the version that was looked at.
    """
    with place.database.writing() as session:
        row = import_for(session, access, Scope.INGEST, import_id)
        check(row)
        stored = service.discard(session, row)
        record(session, access, "discard", "import", row.id, row.site_id)
    Parts(place.settings.storage_url).remove(import_id)
    deletions.sweep(place.database, place.storage, stored)
    return row


def undo(session: Session, access: Access, row: ImageImport) -> None:
    """Delete all images of a batch."""
    count = service.undo(session, row, access.user_id)
    record(session, access, "undo", "import", row.id, row.site_id, images=count)


def restore(session: Session, access: Access, row: ImageImport) -> None:
    """Bring the images of an undone batch back."""
    count = service.restore(session, row)
    record(session, access, "restore", "import", row.id, row.site_id, images=count)


def move(session: Session, access: Access, row: ImageImport, camera_id: int) -> None:
    """Give a batch to another camera, on whose site the caller may ingest too."""
    with looked_up_by("camera_id"):
        target = sites.camera_for(session, access, Scope.INGEST, camera_id)
    before = row.camera_id
    count = service.move(session, row, target)
    record(session, access, "move", "import", row.id, row.site_id, images=count, from_camera=before)
