"""What callers do with batches: the permission, the change and the audit line together."""

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
        for name, stream in files:
            _take(place, row.id, name, stream)
    except BaseException:
        discard(place, access, row.id)
        raise
    return row


def _take(place: Place, import_id: int, name: str, stream: BinaryIO) -> None:
    size_bytes = stream.seek(0, 2)
    stream.seek(0)
    announced = FileIn(path=name, size_bytes=size_bytes)
    (file,) = intake.announce(place, import_id, [announced])
    if file.state is not FileState.WAITING:
        return
    if paths.is_archive(file.path):
        intake.unpack(place, import_id, file, stream)
    else:
        intake.stage(place, import_id, [intake.Blob(file.path, stream.read(), file.id)])


def announce(
    place: Place, access: Access, import_id: int, files: Sequence[FileIn]
) -> list[ImportFile]:
    """Note files that are to come."""
    _require(place, access, import_id)
    return intake.announce(place, import_id, files)


def receive_pack(
    place: Place, access: Access, import_id: int, file_ids: str, body: bytes
) -> list[ImportFile]:
    """Take whole photographs; the ids have commas between."""
    _require(place, access, import_id)
    return receiving.receive_pack(place, import_id, receiving.ids_of(file_ids), body)


def receive_piece(
    place: Place, access: Access, import_id: int, file_id: int, offset: int, body: bytes
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


def discard(place: Place, access: Access, import_id: int) -> ImageImport:
    """Give a batch up before it is committed, and its bytes with it."""
    with place.database.writing() as session:
        row = import_for(session, access, Scope.INGEST, import_id)
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
