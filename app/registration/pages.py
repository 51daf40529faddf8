"""Pages of viewports: keypoints with their residuals, registrations side by side, and forms."""

import re
from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Request, Response, UploadFile
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.db import Database
from app.dependencies import DatabaseDep, SessionDep
from app.errors import AppError, Invalid
from app.forms import ENTRY_ERRORS, Form, Submitted, check_version, parse, rejected
from app.registration import actions, service
from app.registration.keypoint_csv import parse_table, write_table
from app.registration.older_lens import is_of_older_lens
from app.registration.overview import lines_of
from app.registration.readiness import quality_of
from app.registration.schemas import (
    KeypointOut,
    KeypointsIn,
    RegistrationIn,
    RegistrationOut,
    ViewportIn,
    ViewportPatch,
)
from app.reregistration import service as reregistration
from app.runs import service as runs
from app.sites import actions as sites
from app.tables.registration import Registration, RegistrationMethod
from app.tables.sites import Camera, Viewport
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
MOST_TABLE_BYTES = 1_000_000
METHOD_NAMES = {
    RegistrationMethod.PNP: "PnP",
    RegistrationMethod.HOMOGRAPHY_WATER: "Homography, water plane",
    RegistrationMethod.HOMOGRAPHY_PCA: "Homography, principal axes",
    RegistrationMethod.GIVEN: "Given pose",
    RegistrationMethod.ROTATION: "Turned, by photographs",
}


@router.get("/cameras/{camera_id:int}/viewports/new")
def new_viewport(
    request: Request, camera_id: int, session: SessionDep, access: Registrar
) -> Response:
    """Show the form for a new viewport."""
    camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
    return _form_page(request, camera, None, Form())


@router.post("/cameras/{camera_id:int}/viewports")
def create_viewport(
    request: Request, camera_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Make a viewport and show it."""
    try:
        data = parse(ViewportIn, entered | {"camera_id": str(camera_id)})
        with database.writing() as session:
            viewport = actions.create_viewport(session, access, data)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
            form = rejected(entered, error)
            return _form_page(request, camera, None, form, error.status)
    return RedirectResponse(f"/viewports/{viewport.id}", status_code=303)


@router.get("/viewports/{viewport_id:int}")
def show_viewport(
    request: Request, viewport_id: int, session: SessionDep, access: Reader
) -> Response:
    """Show a viewport: how well it is registered, and how to do better."""
    viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
    return _viewport_page(request, session, access, viewport)


@router.get("/viewports/{viewport_id:int}/edit")
def edit_viewport(
    request: Request, viewport_id: int, session: SessionDep, access: Registrar
) -> Response:
    """Show the form that changes a viewport."""
    viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
    return _form_page(request, viewport.camera, viewport, Form(_values(viewport)))


@router.post("/viewports/{viewport_id:int}")
def update_viewport(
    request: Request, viewport_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Change a viewport and show it; an emptied time opens the range."""
    times = {name: entered.get(name) or None for name in ("valid_from", "valid_until")}
    try:
        data = parse(ViewportPatch, {"name": entered.get("name", "")} | times)
        with database.writing() as session:
            viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
            check_version(entered, viewport.version)
            actions.update_viewport(session, access, viewport, data)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
            form = rejected(entered, error)
            return _form_page(request, viewport.camera, viewport, form, error.status)
    return RedirectResponse(f"/viewports/{viewport_id}", status_code=303)


@router.post("/viewports/{viewport_id:int}/keypoints")
def replace_keypoints(
    request: Request,
    viewport_id: int,
    database: DatabaseDep,
    access: Registrar,
    entered: Submitted,
    file: UploadFile | None = None,
) -> Response:
    """Replace the keypoints by a pasted or uploaded table."""
    try:
        table = entered.get("table", "")
        if file is not None and file.size:
            table = _text_of(file)
        data = KeypointsIn(
            keypoints=parse_table(table),
            update_landmarks=entered.get("update_landmarks") == "true",
        )
        with database.writing() as session:
            viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
            check_version(entered, viewport.version)
            actions.replace_keypoints(session, access, viewport, data)
    except ENTRY_ERRORS as error:
        form = rejected({**entered, "table": table}, _in_table(error))
        return _show_again(request, database, access, viewport_id, error, table_form=form)
    return RedirectResponse(f"/viewports/{viewport_id}#keypoints", status_code=303)


@router.post("/viewports/{viewport_id:int}/registrations")
def register(
    request: Request, viewport_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Solve the keypoints by a method, or take the pose that was given."""
    try:
        asked = parse(RegistrationIn, _pose(entered))
        with database.writing() as session:
            actions.register(database, session, access, viewport_id, asked)
    except ENTRY_ERRORS as error:
        is_given = entered.get("method") == RegistrationMethod.GIVEN.value
        name = "given_form" if is_given else "solve_form"
        return _show_again(
            request, database, access, viewport_id, error, **{name: rejected(entered, error)}
        )
    return RedirectResponse(f"/viewports/{viewport_id}#registrations", status_code=303)


def _text_of(file: UploadFile) -> str:
    data = file.file.read(MOST_TABLE_BYTES + 1)
    if len(data) > MOST_TABLE_BYTES:
        raise Invalid.field("table", "is far too large for keypoints")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Invalid.field("table", "is no text in UTF-8; save it as CSV UTF-8") from error


def _in_table(error: AppError) -> AppError:
    """Return an error of single keypoints as one of the table they came in."""
    if all(part.field.startswith("keypoints.") for part in error.fields) and error.fields:
        lines = [
            f"keypoint {int(part.field.split('.')[1]) + 1}: {part.message}" for part in error.fields
        ]
        return Invalid.field("table", "; ".join(lines))
    return error


def _pose(entered: dict[str, str]) -> dict[str, Any]:
    """Return a form's fields with the rotation's numbers as a list."""
    terms = [term for term in re.split(r"[\s,;]+", entered.get("rotation", "")) if term]
    return entered | {"rotation": terms or ""}


def _values(viewport: Viewport) -> dict[str, object]:
    times: dict[str, object] = {
        name: f"{moment:%Y-%m-%dT%H:%M:%SZ}" if moment else ""
        for name, moment in (
            ("valid_from", viewport.valid_from),
            ("valid_until", viewport.valid_until),
        )
    }
    return {"name": viewport.name} | times


def _show_again(
    request: Request,
    database: Database,
    access: Access,
    viewport_id: int,
    error: AppError,
    **forms: Form,
) -> Response:
    with database.reading() as session:
        viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
        return _viewport_page(request, session, access, viewport, error.status, **forms)


def _viewport_page(
    request: Request,
    session: SessionDep,
    access: Access,
    viewport: Viewport,
    status: int = 200,
    *,
    table_form: Form | None = None,
    solve_form: Form | None = None,
    given_form: Form | None = None,
) -> Response:
    keypoints = [KeypointOut.of(point) for point in service.keypoints_of(session, viewport.id)]
    (line,) = lines_of(session, [viewport])
    table = write_table([point.model_dump(mode="json") for point in keypoints]) if keypoints else ""
    current = RegistrationOut.of(line.registration) if line.registration else None
    residuals = {item.keypoint_id: item for item in current.residuals} if current else {}
    rows = [(point, residuals.get(point.id)) for point in keypoints]
    rows.sort(key=lambda row: -(row[1].error_px or 0.0) if row[1] else 0.0)
    return page(
        request,
        "registration/viewport.html",
        status_code=status,
        crumbs=[*_crumbs(viewport.camera), {"label": viewport.name}],
        viewport=viewport,
        camera=viewport.camera,
        site=viewport.camera.site,
        line=line,
        current=current,
        is_of_older_lens=line.registration is not None
        and is_of_older_lens(line.registration, viewport.camera),
        rows=rows,
        stale_runs=runs.stale_runs(session, viewport.id),
        solutions=[
            (METHOD_NAMES[found.method], RegistrationOut.of(found), quality_of(found))
            for found in _best_first(service.newest_by_method(session, viewport.id))
        ],
        table_form=table_form or Form({"table": table}),
        solve_form=solve_form or Form(),
        given_form=given_form or Form(),
        may_register=access.may(Scope.REGISTER, viewport.camera.site_id),
        may_ingest=access.may(Scope.INGEST, viewport.camera.site_id),
        movements=reregistration.movements(session, [viewport.id]),
    )


def _best_first(registrations: Sequence[Registration]) -> list[Registration]:
    """Sort by what the table shows: a pose before homographies, then by the error to trust."""
    return sorted(
        registrations,
        key=lambda found: (found.rotation is None, found.leave_one_out_px or 0.0, -found.id),
    )


def _form_page(
    request: Request, camera: Camera, viewport: Viewport | None, form: Form, status: int = 200
) -> Response:
    crumbs = _crumbs(camera)
    if viewport is None:
        crumbs.append({"label": "New viewport"})
    else:
        place = {"label": viewport.name, "href": f"/viewports/{viewport.id}"}
        crumbs += [place, {"label": "Edit"}]
    return page(
        request,
        "registration/edit.html",
        status_code=status,
        crumbs=crumbs,
        camera=camera,
        viewport=viewport,
        form=form,
    )


def _crumbs(camera: Camera) -> list[dict[str, str]]:
    return [
        {"label": "Sites", "href": "/sites"},
        {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
        {"label": camera.name, "href": f"/cameras/{camera.id}"},
    ]
