"""Pages of batches: choose files, look at what they would become, commit; undo and move later."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, BinaryIO

from fastapi import APIRouter, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep, SettingsDep, StorageDep
from app.errors import AppError, Invalid, TooLarge, UnsupportedMedia
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.imagery import service as imagery
from app.imports import actions, service
from app.imports.intake import Place
from app.imports.schemas import ImportIn, ImportOut, MoveIn, PreviewOut
from app.imports.times import TimeSettings
from app.paging import Paging
from app.sites import actions as sites
from app.sites import service as site_service
from app.tables.imports import ImageImport, ImportStatus
from app.tables.sites import Camera
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Ingester = Annotated[Access, allowed(Scope.INGEST)]
IMPORTS_SHOWN = 50
EXAMPLES_SHOWN = 200
MOST_TABLE_BYTES = 16 << 20
EVERY_CAMERA = Paging(limit=500, after=None)
TIME_FIELDS = ("rule", "patterns", "timezone", "follows_summer_time", "repeated_hour")


@router.get("/cameras/{camera_id:int}/imports")
def list_imports(request: Request, camera_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a camera's batches, and the form that begins one."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    return _list_page(request, session, access, camera, Form())


@router.post("/cameras/{camera_id:int}/imports")
def start(
    request: Request,
    camera_id: int,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Ingester,
    entered: Submitted,
    files: list[UploadFile] | None = None,
) -> Response:
    """Begin a batch with the files of a form; browsers with scripts send them one by one."""
    place = Place(database, storage, settings)
    sent: list[tuple[str, BinaryIO]] = [
        (file.filename, file.file) for file in files or () if file.filename
    ]
    name = entered.get("name", "")
    try:
        if not sent:
            with database.reading() as session:
                sites.camera_for(session, access, Scope.INGEST, camera_id)
            raise Invalid.field("files", "choose photographs, or a zip of them")
        wanted = parse(ImportIn, {"camera_id": camera_id, "name": name or None})
        row = actions.start(place, access, wanted, sent)
    except (*ENTRY_ERRORS, TooLarge, UnsupportedMedia) as error:
        with database.reading() as session:
            camera = sites.camera_for(session, access, Scope.INGEST, camera_id)
            form = rejected({"name": name, "files": ""}, error)
            return _list_page(request, session, access, camera, form, error.status)
    return RedirectResponse(f"/imports/{row.id}", status_code=303)


@router.get("/imports/{import_id:int}")
def show(request: Request, import_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a batch as it stands; fields of the time form in the address are tried, not stored."""
    row = actions.import_for(session, access, Scope.READ, import_id)
    return _show_page(request, session, access, row, _tried(row, dict(request.query_params)))


@router.post("/imports/{import_id:int}/times-table")
def set_times_table(
    request: Request,
    import_id: int,
    session: SessionDep,
    access: Ingester,
    table: UploadFile | None = None,
) -> Response:
    """Take a CSV of names and times, and look at what it does."""
    row = actions.import_for(session, access, Scope.INGEST, import_id)
    try:
        actions.set_listed_times(session, access, row, _text_of(table))
    except (*ENTRY_ERRORS, TooLarge) as error:
        tried = _tried(row, {})
        return _show_page(request, session, access, row, tried, error)
    return RedirectResponse(f"/imports/{row.id}?rule=csv&timezone={_zone(row)}", status_code=303)


@router.post("/imports/{import_id:int}/commit")
def commit(
    request: Request,
    import_id: int,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Ingester,
    entered: Submitted,
) -> Response:
    """Make images of a batch with the times as they were shown."""
    place = Place(database, storage, settings)
    try:
        with database.writing() as session:
            row = actions.import_for(session, access, Scope.INGEST, import_id)
            tried = _tried(row, entered)
            if tried.times is None:
                raise Invalid("the times cannot be told like this", fields=tried.fields)
            if tried.times != service.times_of(row):
                actions.set_times(session, access, row, tried.times)
        is_partial = entered.get("leave_out_waiting") == "true"
        actions.commit(place, access, import_id, _unchecked, leave_out_waiting=is_partial)
    except ENTRY_ERRORS as error:
        return _show_again(request, database, access, import_id, error, entered)
    return RedirectResponse(f"/imports/{import_id}", status_code=303)


@router.post("/imports/{import_id:int}/discard")
def discard(
    import_id: int,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Ingester,
) -> Response:
    """Give a batch up and go back to its camera's."""
    row = actions.discard(Place(database, storage, settings), access, import_id)
    return RedirectResponse(f"/cameras/{row.camera_id}/imports", status_code=303)


@router.post("/imports/{import_id:int}/undo")
def undo(request: Request, import_id: int, database: DatabaseDep, access: Ingester) -> Response:
    """Delete all images of a batch."""
    return _acted(request, database, access, import_id, actions.undo)


@router.post("/imports/{import_id:int}/restore")
def restore(request: Request, import_id: int, database: DatabaseDep, access: Ingester) -> Response:
    """Bring the images of a batch back."""
    return _acted(request, database, access, import_id, actions.restore)


@router.post("/imports/{import_id:int}/move")
def move(
    request: Request,
    import_id: int,
    database: DatabaseDep,
    access: Ingester,
    entered: Submitted,
) -> Response:
    """Give a batch to another camera."""

    def act(session: Session, access: Access, row: ImageImport) -> None:
        wanted = parse(MoveIn, {"camera_id": entered.get("camera_id", "")})
        actions.move(session, access, row, wanted.camera_id)

    return _acted(request, database, access, import_id, act)


def _acted(
    request: Request,
    database: DatabaseDep,
    access: Access,
    import_id: int,
    act: Any,  # noqa: ANN401  one of the actions above
) -> Response:
    try:
        with database.writing() as session:
            row = actions.import_for(session, access, Scope.INGEST, import_id)
            act(session, access, row)
    except ENTRY_ERRORS as error:
        return _show_again(request, database, access, import_id, error, {})
    return RedirectResponse(f"/imports/{import_id}", status_code=303)


def _unchecked(_row: ImageImport) -> None:
    """Compare nothing: the times that were shown have just been stored."""


@dataclass(frozen=True, slots=True)
class _Tried:
    """A time rule as it was entered, and read where it can be."""

    entered: Mapping[str, object]
    times: TimeSettings | None
    error: Invalid | None = None

    @property
    def fields(self) -> tuple[Any, ...]:
        """What is wrong with which field."""
        return self.error.fields if self.error else ()


def _tried(row: ImageImport, entered: Mapping[str, str]) -> _Tried:
    """Read the time form; without it the batch's own rule counts."""
    own = service.times_of(row)
    if "rule" not in entered:
        return _Tried(own.model_dump(mode="json") | {"patterns": "\n".join(own.patterns)}, own)
    shown = {name: entered.get(name, "") for name in TIME_FIELDS}
    values: dict[str, Any] = {
        "rule": shown["rule"],
        "patterns": [line.strip() for line in shown["patterns"].splitlines() if line.strip()],
        "timezone": shown["timezone"] or own.timezone,
        "follows_summer_time": entered.get("standard_time_only") != "true",
        "repeated_hour": shown["repeated_hour"] or own.repeated_hour.value,
    }
    kept = {**values, "patterns": shown["patterns"]}
    try:
        return _Tried(kept, parse(TimeSettings, values))
    except Invalid as error:
        return _Tried(kept, None, error)


def _zone(row: ImageImport) -> str:
    return service.times_of(row).timezone


def _text_of(file: UploadFile | None) -> str:
    if file is None or not file.size:
        raise Invalid.field("table", "choose a CSV file")
    data = file.file.read(MOST_TABLE_BYTES + 1)
    if len(data) > MOST_TABLE_BYTES:
        raise TooLarge(f"a table has at most {MOST_TABLE_BYTES:,} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Invalid.field("table", "is no text in UTF-8; save it as CSV UTF-8") from error


def _list_page(
    request: Request,
    session: Session,
    access: Access,
    camera: Camera,
    form: Form,
    status: int = 200,
) -> Response:
    rows = service.newest(session, camera.id, IMPORTS_SHOWN)
    return page(
        request,
        "imports/camera.html",
        status_code=status,
        crumbs=[*_crumbs(camera), {"label": "Import"}],
        camera=camera,
        site=camera.site,
        imports=[ImportOut.of(row) for row in rows],
        has_images=bool(imagery.spans_of_cameras(session, [camera.id])),
        form=form,
        may_ingest=access.may(Scope.INGEST, camera.site_id),
    )


def _show_again(
    request: Request,
    database: DatabaseDep,
    access: Access,
    import_id: int,
    error: AppError,
    entered: Mapping[str, str],
) -> Response:
    with database.reading() as session:
        row = actions.import_for(session, access, Scope.READ, import_id)
        return _show_page(request, session, access, row, _tried(row, entered), error)


def _show_page(
    request: Request,
    session: Session,
    access: Access,
    row: ImageImport,
    tried: _Tried,
    error: AppError | None = None,
) -> Response:
    camera = row.camera
    is_open = row.status is ImportStatus.COLLECTING
    made = service.preview_of(session, row, tried.times) if is_open else None
    proposals = service.proposals(session, row) if is_open else []
    errors = {field.field.partition(".")[0]: field.message for field in tried.fields}
    if error is not None:
        errors |= {field.field: field.message for field in error.fields}
    return page(
        request,
        "imports/show.html",
        status_code=error.status if error else 422 if tried.error else 200,
        crumbs=[
            *_crumbs(camera),
            {"label": "Import", "href": f"/cameras/{camera.id}/imports"},
            {"label": row.name},
        ],
        camera=camera,
        site=camera.site,
        batch=ImportOut.of(row),
        made=(
            PreviewOut.of(made, service.viewports(session, row), proposals, EXAMPLES_SHOWN)
            if made
            else None
        ),
        along=None if is_open else service.takes_along(session, row),
        cameras=_others(session, access, camera),
        has_images=bool(imagery.spans_of_cameras(session, [camera.id])),
        kept_until=row.undone_at + service.KEPT_FOR if row.undone_at else None,
        times=Form(tried.entered, errors, error.detail if error else ""),
        may_ingest=access.may(Scope.INGEST, row.site_id),
    )


def _others(session: Session, access: Access, camera: Camera) -> list[tuple[int, str]]:
    """Return id and name of the cameras of the same image size that a batch could move to."""
    found, _ = site_service.list_cameras(session, access.site_ids(Scope.INGEST), None, EVERY_CAMERA)
    size = (camera.width_px, camera.height_px)
    return [
        (other.id, f"{other.name}, {other.site.name}")
        for other in found
        if other.id != camera.id and (other.width_px, other.height_px) == size
    ]


def _crumbs(camera: Camera) -> list[dict[str, str]]:
    return [
        {"label": "Sites", "href": "/sites"},
        {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
        {"label": camera.name, "href": f"/cameras/{camera.id}"},
    ]
