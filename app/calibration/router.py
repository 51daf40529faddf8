"""REST of calibrations: photographs of a chequerboard in, a version of the camera's lens out."""

from typing import Annotated

from fastapi import APIRouter, Form, Query, Request, Response, UploadFile

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, set_etag
from app.calibration import actions, service
from app.calibration.schemas import (
    BoardIn,
    CalibrationOut,
    CalibrationWithPhotosOut,
    LeftOutIn,
    PhotoOut,
)
from app.dependencies import (
    DatabaseDep,
    JobsDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)
from app.imagery.preview import WIDTHS_PX, make_preview, snapped_width
from app.openapi_bodies import file_answer
from app.sites import actions as sites
from app.tables.calibration import CameraCalibration

router = APIRouter(tags=["calibrations"], route_class=IdempotentRoute)
RETRY_AFTER_S = 1
NEVER_CHANGES = "private, max-age=31536000, immutable"

Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.post("/cameras/{camera_id:int}/calibrations", status_code=202)
def start_calibration(
    camera_id: int,
    files: list[UploadFile],
    columns: Annotated[int, Form(ge=3, le=40, description="Inner corners in a row", examples=[9])],
    rows: Annotated[int, Form(ge=3, le=40, description="Inner corners in a column", examples=[6])],
    square_mm: Annotated[float, Form(gt=0, le=2000, description="Side of a square", examples=[30])],
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Registrar,
    response: Response,
) -> CalibrationOut:
    """Upload photographs of a chequerboard; a worker finds the corners and solves the lens."""
    board = BoardIn(columns=columns, rows=rows, square_mm=square_mm)
    sent = [(file.filename, file.file) for file in files]
    row = actions.start(database, storage, settings, jobs, access, camera_id, board, sent)
    response.headers["Location"] = f"/api/v1/calibrations/{row.id}"
    response.headers["Retry-After"] = str(RETRY_AFTER_S)
    return CalibrationOut.of(row, is_active=False)


@router.get("/cameras/{camera_id:int}/calibrations")
def list_calibrations(
    camera_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Page[CalibrationOut]:
    """List the versions of a camera's intrinsics, oldest first."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    rows, cursor = service.list_calibrations(session, camera.id, paging)
    items = [CalibrationOut.of(row, is_active=service.is_active(row)) for row in rows]
    return Page(items=items, next_cursor=cursor)


@router.get("/calibrations/{calibration_id:int}")
def get_calibration(
    calibration_id: int, session: SessionDep, access: Reader, response: Response
) -> CalibrationWithPhotosOut:
    """Return a calibration with its photographs, their corners and errors."""
    row = actions.calibration_for(session, access, Scope.READ, calibration_id)
    set_etag(response, row.version)
    return _shown(session, row)


@router.put("/calibrations/{calibration_id:int}/left-out", dependencies=[VERSIONED])
def leave_out_photos(
    calibration_id: int,
    body: LeftOutIn,
    request: Request,
    database: DatabaseDep,
    access: Registrar,
    response: Response,
) -> CalibrationWithPhotosOut:
    """Solve again without some photographs; takes If-Match."""
    actions.leave_out(
        database,
        access,
        calibration_id,
        body.left_out,
        lambda row: check_if_match(request, row.version),
    )
    with database.reading() as session:
        row = service.get(session, calibration_id)
        set_etag(response, row.version)
        return _shown(session, row)


@router.post("/calibrations/{calibration_id:int}/activate")
def activate_calibration(
    calibration_id: int, session: SessionDep, access: Registrar
) -> CalibrationOut:
    """Use this version for registrations to come; those made before keep their own intrinsics."""
    row = actions.calibration_for(session, access, Scope.REGISTER, calibration_id)
    actions.activate(session, access, row)
    return CalibrationOut.of(row, is_active=True)


@router.get(
    "/calibrations/{calibration_id:int}/photos/{photo_number:int}/preview",
    response_class=Response,
    responses=file_answer("image/jpeg"),
)
def get_calibration_photo(
    calibration_id: int,
    photo_number: int,
    session: SessionDep,
    storage: StorageDep,
    access: Reader,
    width: Annotated[int, Query(ge=1, description=f"Rounded up to one of {WIDTHS_PX}")] = 640,
) -> Response:
    """Send a smaller JPEG of a photograph of the board."""
    row = actions.calibration_for(session, access, Scope.READ, calibration_id)
    photo = service.get_photo(session, row.id, photo_number)
    width_px = snapped_width(width)
    data = storage.derived(
        f"previews/{photo.sha256[:2]}/{photo.sha256}-{width_px}.jpg",
        lambda: make_preview(storage.read(photo.sha256), photo.media_type, width_px),
    )
    return Response(data, media_type="image/jpeg", headers={"Cache-Control": NEVER_CHANGES})


def _shown(session: SessionDep, row: CameraCalibration) -> CalibrationWithPhotosOut:
    shown = CalibrationWithPhotosOut.of(row, is_active=service.is_active(row))
    shown.photos = [PhotoOut.of(photo) for photo in service.photos(session, row.id)]
    return shown
