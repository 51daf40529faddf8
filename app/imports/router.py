"""REST of batches: begin, announce files, send their bytes, look, commit; undo, restore, move."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Query, Request, Response
from pydantic import ValidationError
from starlette.datastructures import UploadFile

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, heed_if_match, set_etag
from app.dependencies import (
    DatabaseDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)
from app.errors import Invalid, UnsupportedMedia
from app.forms import parse
from app.imports import actions, service
from app.imports.intake import Place
from app.imports.octets import Octets
from app.imports.schemas import (
    CommitIn,
    FileOut,
    ImportIn,
    ImportOut,
    ManifestIn,
    ManifestOut,
    MoveIn,
    PreviewOut,
    TakesAlongOut,
    TimesTableOut,
)
from app.imports.times import TimeSettings
from app.tables.imports import FileState, ImportStatus

router = APIRouter(tags=["imports"], route_class=IdempotentRoute)
MOST_UPLOADED = 1_000
Reader = Annotated[Access, allowed(Scope.READ)]
Ingester = Annotated[Access, allowed(Scope.INGEST)]
OCTETS: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}


async def _place(database: DatabaseDep, storage: StorageDep, settings: SettingsDep) -> Place:
    return Place(database, storage, settings)


async def _octets(request: Request) -> Octets:
    return Octets([piece async for piece in request.stream()])


class _Begun:
    """What a new batch is begun with: its fields, and files where it came as a form."""

    def __init__(self, wanted: ImportIn, files: list[tuple[str, Any]]) -> None:
        self.wanted = wanted
        self.files = files


async def _begun(request: Request) -> _Begun:
    content_type = request.headers.get("content-type", "").lower()
    if content_type.startswith("multipart/"):
        form = await request.form(max_files=MOST_UPLOADED, max_fields=20)
        parts = form.multi_items()
        fields = {name: value for name, value in parts if isinstance(value, str)}
        files = [
            (value.filename or "unnamed", value.file)
            for _, value in parts
            if isinstance(value, UploadFile)
        ]
        return _Begun(parse(ImportIn, fields), files)
    if not content_type.startswith("application/json"):
        raise UnsupportedMedia("send JSON, or a form with camera_id and files")
    try:
        return _Begun(ImportIn.model_validate_json(await request.body()), [])
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(step) for step in first["loc"]) or "body"
        raise Invalid.field(field, first["msg"]) from error


PlaceDep = Annotated[Place, Depends(_place)]
OctetsDep = Annotated[Octets, Depends(_octets)]
BegunDep = Annotated[_Begun, Depends(_begun)]
BEGIN: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": ImportIn.model_json_schema()}},
    }
}


@router.post("/imports", status_code=201, openapi_extra=BEGIN)
def start_import(
    begun: BegunDep, access: Ingester, place: PlaceDep, response: Response
) -> ImportOut:
    """Begin a batch for a camera; then announce its files and send them.

    A form (multipart/form-data) with `camera_id` brings photographs and zips along at once, as
    parts named `file`. An archive that is hostile or damaged is refused (413, 422) and leaves no
    batch behind.
    """
    row = actions.start(place, access, begun.wanted, begun.files)
    response.headers["Location"] = f"/api/v1/imports/{row.id}"
    set_etag(response, row.version)
    return ImportOut.of(row)


@router.get("/imports")
def list_imports(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    camera_id: int | None = None,
    status: ImportStatus | None = None,
) -> Page[ImportOut]:
    """List batches on the sites that the caller may read, oldest first."""
    rows, cursor = service.list_imports(
        session, access.site_ids(Scope.READ), camera_id, status, paging
    )
    return Page(items=[ImportOut.of(row) for row in rows], next_cursor=cursor)


@router.get("/imports/{import_id:int}")
def get_import(
    import_id: int, session: SessionDep, access: Reader, response: Response
) -> ImportOut:
    """Return a batch."""
    row = actions.import_for(session, access, Scope.READ, import_id)
    set_etag(response, row.version)
    return ImportOut.of(row)


@router.post("/imports/{import_id:int}/files")
def announce_files(
    import_id: int, body: ManifestIn, access: Ingester, place: PlaceDep
) -> ManifestOut:
    """Announce files; the answer says of each whether and from where on it is to be sent.

    Announcing the same again after a break loses nothing and sends nothing twice.
    """
    files = actions.announce(place, access, import_id, body.files)
    return ManifestOut(files=[FileOut.model_validate(file) for file in files])


@router.get("/imports/{import_id:int}/files")
def list_import_files(
    import_id: int,
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    state: FileState | None = None,
) -> Page[FileOut]:
    """List a batch's files in the order they were announced."""
    row = actions.import_for(session, access, Scope.READ, import_id)
    files, cursor = service.list_files(session, row.id, state, paging)
    return Page(items=[FileOut.model_validate(file) for file in files], next_cursor=cursor)


@router.post("/imports/{import_id:int}/pack", openapi_extra=OCTETS)
def upload_pack(
    import_id: int,
    body: OctetsDep,
    access: Ingester,
    place: PlaceDep,
    files: Annotated[str, Query(max_length=8_000, description="Ids, with commas between")] = "",
) -> ManifestOut:
    """Send whole photographs: their bytes one behind the other, in the order of the ids.

    A pack has up to 16 MiB; what is larger is sent in pieces.
    """
    received = actions.receive_pack(place, access, import_id, files, body)
    return ManifestOut(files=[FileOut.model_validate(file) for file in received])


@router.put("/imports/{import_id:int}/files/{import_file_id:int}", openapi_extra=OCTETS)
def upload_piece(
    import_id: int,
    import_file_id: int,
    body: OctetsDep,
    access: Ingester,
    place: PlaceDep,
    offset: Annotated[int, Query(ge=0, lt=2**53, description="Where in the file it begins")] = 0,
) -> FileOut:
    """Send a file, or the piece of it that begins at `offset`, up to 16 MiB at once.

    With the last piece a photograph is checked and a zip unpacked. A piece that does not continue
    what is here gives 409 with `received_bytes`.
    """
    file = actions.receive_piece(place, access, import_id, import_file_id, offset, body)
    return FileOut.model_validate(file)


@router.get("/imports/{import_id:int}/preview")
def preview_import(import_id: int, session: SessionDep, access: Reader) -> PreviewOut:
    """Tell what a commit would do: how many images, their times and viewports, what is odd."""
    row = actions.import_for(session, access, Scope.READ, import_id)
    return PreviewOut.of(
        service.preview_of(session, row),
        service.viewports(session, row),
        service.proposals(session, row),
    )


@router.put("/imports/{import_id:int}/times", dependencies=[VERSIONED])
def set_import_times(
    import_id: int,
    body: TimeSettings,
    request: Request,
    session: SessionDep,
    access: Ingester,
    response: Response,
) -> ImportOut:
    """Choose how the files tell when they were taken; takes If-Match."""
    row = actions.import_for(session, access, Scope.INGEST, import_id)
    check_if_match(request, row.version)
    actions.set_times(session, access, row, body)
    set_etag(response, row.version)
    return ImportOut.of(row)


@router.put("/imports/{import_id:int}/times-table", dependencies=[VERSIONED])
def set_import_times_table(
    import_id: int,
    request: Request,
    session: SessionDep,
    access: Ingester,
    response: Response,
    times: Annotated[str, Body(embed=True, max_length=16 * 2**20, description="CSV: name, time")],
) -> TimesTableOut:
    """Give the times as a table: file name (or path), time in ISO 8601; heeds If-Match."""
    row = actions.import_for(session, access, Scope.INGEST, import_id)
    heed_if_match(request, row.version)
    taken = actions.set_listed_times(session, access, row, times)
    set_etag(response, row.version)
    return taken


@router.post("/imports/{import_id:int}/commit", dependencies=[VERSIONED])
def commit_import(
    import_id: int,
    request: Request,
    access: Ingester,
    place: PlaceDep,
    response: Response,
    body: CommitIn | None = None,
) -> ImportOut:
    """Make images of the batch, all of them or none; `If-Match` says what was looked at."""
    row = actions.commit(
        place,
        access,
        import_id,
        lambda row: heed_if_match(request, row.version),
        leave_out_waiting=body is not None and body.leave_out_waiting,
    )
    set_etag(response, row.version)
    return ImportOut.of(row)


@router.delete("/imports/{import_id:int}", status_code=204, dependencies=[VERSIONED])
def discard_import(import_id: int, request: Request, access: Ingester, place: PlaceDep) -> None:
    """Give a batch up that is not committed; heeds If-Match."""
    actions.discard(place, access, import_id, lambda row: heed_if_match(request, row.version))


@router.get("/imports/{import_id:int}/takes-along")
def get_taken_along(import_id: int, session: SessionDep, access: Reader) -> TakesAlongOut:
    """Count what disappears with the batch's images: poses, reviews, corrections."""
    row = actions.import_for(session, access, Scope.READ, import_id)
    return service.takes_along(session, row)


@router.post("/imports/{import_id:int}/undo", dependencies=[VERSIONED])
def undo_import(
    import_id: int, request: Request, session: SessionDep, access: Ingester
) -> ImportOut:
    """Delete all images of a committed batch; `restore` brings them back for 30 days."""
    row = actions.import_for(session, access, Scope.INGEST, import_id)
    heed_if_match(request, row.version)
    actions.undo(session, access, row)
    return ImportOut.of(row)


@router.post("/imports/{import_id:int}/restore", dependencies=[VERSIONED])
def restore_import(
    import_id: int, request: Request, session: SessionDep, access: Ingester
) -> ImportOut:
    """Bring the images of an undone batch back, with all that rests on them."""
    row = actions.import_for(session, access, Scope.INGEST, import_id)
    heed_if_match(request, row.version)
    actions.restore(session, access, row)
    return ImportOut.of(row)


@router.post("/imports/{import_id:int}/move", dependencies=[VERSIONED])
def move_import(
    import_id: int, body: MoveIn, request: Request, session: SessionDep, access: Ingester
) -> ImportOut:
    """Give the batch to another camera; what rests on its images stays behind, deleted."""
    row = actions.import_for(session, access, Scope.INGEST, import_id)
    heed_if_match(request, row.version)
    actions.move(session, access, row, body.camera_id)
    return ImportOut.of(row)
