"""Pages of calibrations: upload photographs, see corners and errors, choose the version in use."""

import re
from collections.abc import Sequence
from typing import Annotated, BinaryIO

from fastapi import APIRouter, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.calibration import actions, service
from app.calibration.schemas import BoardIn, CalibrationOut, PhotoOut
from app.db import Database
from app.dependencies import DatabaseDep, JobsDep, SessionDep, SettingsDep, StorageDep
from app.errors import AppError, TooLarge, UnsupportedMedia
from app.forms import ENTRY_ERRORS, Form, Submitted, check_version, parse, rejected
from app.sites import actions as sites
from app.tables.calibration import CameraCalibration
from app.tables.sites import Camera
from app.templating import page

router = APIRouter()
BOARD = frozenset(BoardIn.model_fields)
LEFT_OUT = re.compile(r"left_out_(\d{1,3})")

Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.get("/cameras/{camera_id:int}/calibrations")
def list_calibrations(
    request: Request, camera_id: int, session: SessionDep, access: Reader
) -> Response:
    """Show the versions of a camera's intrinsics, and the form that starts a calibration."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    return _list_page(request, session, access, camera, Form({"columns": 9, "rows": 6}))


@router.post("/cameras/{camera_id:int}/calibrations")
def start(
    request: Request,
    camera_id: int,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Registrar,
    entered: Submitted,
    files: list[UploadFile] | None = None,
) -> Response:
    """Take photographs of a chequerboard in and show the calibration."""
    sent: list[tuple[str | None, BinaryIO]] = [
        (file.filename, file.file) for file in files or () if file.filename
    ]
    try:
        board = parse(BoardIn, {name: value for name, value in entered.items() if name in BOARD})
        row = actions.start(database, storage, settings, jobs, access, camera_id, board, sent)
    except (*ENTRY_ERRORS, TooLarge, UnsupportedMedia) as error:
        with database.reading() as session:
            camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
            form = rejected({**entered, "files": ""}, error)
            return _list_page(request, session, access, camera, form, error.status)
    return RedirectResponse(f"/calibrations/{row.id}", status_code=303)


@router.get("/calibrations/{calibration_id:int}")
def show(request: Request, calibration_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a calibration: its lens, its photographs with corners, and what is wrong with them."""
    row = actions.calibration_for(session, access, Scope.READ, calibration_id)
    return _show_page(request, session, access, row)


@router.post("/calibrations/{calibration_id:int}/left-out")
def leave_out(
    request: Request,
    calibration_id: int,
    database: DatabaseDep,
    access: Registrar,
    entered: Submitted,
) -> Response:
    """Solve again without the ticked photographs."""
    names = (LEFT_OUT.fullmatch(name) for name in entered)
    numbers = [int(found[1]) for found in names if found]
    try:
        actions.leave_out(
            database,
            access,
            calibration_id,
            numbers,
            lambda row: check_version(entered, row.version),
        )
    except ENTRY_ERRORS as error:
        return _show_again(request, database, access, calibration_id, error)
    return RedirectResponse(f"/calibrations/{calibration_id}", status_code=303)


@router.post("/calibrations/{calibration_id:int}/activate")
def activate(
    request: Request, calibration_id: int, database: DatabaseDep, access: Registrar
) -> Response:
    """Use a version from now on and show the history."""
    try:
        with database.writing() as session:
            row = actions.calibration_for(session, access, Scope.REGISTER, calibration_id)
            actions.activate(session, access, row)
            camera_id = row.camera_id
    except ENTRY_ERRORS as error:
        return _show_again(request, database, access, calibration_id, error)
    return RedirectResponse(f"/cameras/{camera_id}/calibrations", status_code=303)


def _show_again(
    request: Request, database: Database, access: Access, calibration_id: int, error: AppError
) -> Response:
    with database.reading() as session:
        row = actions.calibration_for(session, access, Scope.REGISTER, calibration_id)
        return _show_page(request, session, access, row, error.detail, error.status)


def _list_page(
    request: Request,
    session: Session,
    access: Access,
    camera: Camera,
    form: Form,
    status: int = 200,
) -> Response:
    return page(
        request,
        "calibration/list.html",
        status_code=status,
        crumbs=[*_crumbs(camera), {"label": "Calibration"}],
        camera=camera,
        versions=_shown(service.history(session, camera.id)),
        form=form,
        may_register=access.may(Scope.REGISTER, camera.site_id),
    )


def _show_page(
    request: Request,
    session: Session,
    access: Access,
    row: CameraCalibration,
    message: str = "",
    status: int = 200,
) -> Response:
    camera = row.camera
    photos = [PhotoOut.of(photo) for photo in service.photos(session, row.id)]
    return page(
        request,
        "calibration/show.html",
        status_code=status,
        crumbs=[
            *_crumbs(camera),
            {"label": "Calibration", "href": f"/cameras/{camera.id}/calibrations"},
            {"label": f"Version {row.number}"},
        ],
        camera=camera,
        calibration=_shown([row])[0],
        searched=sum(photo.corners_px is not None or photo.problem is not None for photo in photos),
        photos=photos,
        used=[photo for photo in photos if photo.is_used],
        is_open=row.status in service.OPEN,
        message=message,
        may_register=access.may(Scope.REGISTER, camera.site_id),
    )


def _shown(rows: Sequence[CameraCalibration]) -> list[CalibrationOut]:
    return [CalibrationOut.of(row, is_active=service.is_active(row)) for row in rows]


def _crumbs(camera: Camera) -> list[dict[str, str]]:
    return [
        {"label": "Sites", "href": "/sites"},
        {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
        {"label": camera.name, "href": f"/cameras/{camera.id}"},
    ]
