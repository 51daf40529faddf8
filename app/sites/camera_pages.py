"""The forms of cameras: a new one, and changes of one. The camera's own page is imagery's."""

import re
from typing import Annotated, Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.db import Database
from app.dependencies import DatabaseDep, SessionDep
from app.forms import ENTRY_ERRORS, Form, Submitted, check_version, parse, rejected
from app.sites import actions
from app.sites.first_guess import with_guess
from app.sites.schemas import CameraIn, CameraPatch
from app.tables.sites import Camera, Site
from app.templating import page

router = APIRouter()
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
FIELDS = (
    "name",
    "width_px",
    "height_px",
    "fx_px",
    "fy_px",
    "cx_px",
    "cy_px",
    "timezone",
    "file_name_pattern",
)


@router.get("/sites/{site_id:int}/cameras/new")
def new_camera(request: Request, site_id: int, session: SessionDep, access: Registrar) -> Response:
    """Show the form for a new camera."""
    site = actions.site_for(session, access, Scope.REGISTER, site_id)
    return _form_page(request, site, None, Form({"timezone": site.timezone}))


@router.post("/sites/{site_id:int}/cameras")
def create_camera(
    request: Request, site_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Make a camera and show it."""
    try:
        data = parse(CameraIn, _typed(with_guess(entered)) | {"site_id": site_id})
        with database.writing() as session:
            camera = actions.create_camera(session, access, data)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            site = actions.site_for(session, access, Scope.REGISTER, site_id)
        return _form_page(request, site, None, rejected(entered, error), error.status)
    return RedirectResponse(f"/cameras/{camera.id}", status_code=303)


@router.get("/cameras/{camera_id:int}/edit")
def edit_camera(
    request: Request, camera_id: int, session: SessionDep, access: Registrar
) -> Response:
    """Show the form that changes a camera."""
    camera = actions.camera_for(session, access, Scope.REGISTER, camera_id)
    return _form_page(request, camera.site, camera, Form(_values(camera)))


@router.post("/cameras/{camera_id:int}")
def update_camera(
    request: Request, camera_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Change a camera and show it."""
    values = {name: value for name, value in entered.items() if name != "version"}
    try:
        # An emptied pattern is taken away; other fields left empty stay as they are.
        emptied = {} if entered.get("file_name_pattern") else {"file_name_pattern": None}
        data = parse(CameraPatch, _typed(values) | emptied)
        with database.writing() as session:
            camera = actions.camera_for(session, access, Scope.REGISTER, camera_id)
            check_version(entered, camera.version)
            actions.update_camera(session, access, camera, data)
    except ENTRY_ERRORS as error:
        form = rejected(entered, error)
        return _edit_again(request, database, access, camera_id, form, error.status)
    return RedirectResponse(f"/cameras/{camera_id}", status_code=303)


def _typed(entered: dict[str, str]) -> dict[str, Any]:
    """Return a form's fields with the distortion's terms as a list."""
    terms = [term for term in re.split(r"[\s,;]+", entered.get("distortion", "")) if term]
    return entered | {"distortion": terms}


def _values(camera: Camera) -> dict[str, object]:
    values: dict[str, object] = {name: getattr(camera, name) for name in FIELDS}
    terms = camera.distortion if any(camera.distortion) else []
    return values | {"distortion": " ".join(str(term) for term in terms)}


def _edit_again(
    request: Request,
    database: Database,
    access: Access,
    camera_id: int,
    form: Form | None,
    status: int,
    message: str = "",
) -> Response:
    # Asked again: the form may be wrong before anybody asked whose camera it is.
    with database.reading() as session:
        camera = actions.camera_for(session, access, Scope.REGISTER, camera_id)
        form = form or Form(_values(camera), message=message)
        return _form_page(request, camera.site, camera, form, status)


def _form_page(
    request: Request, site: Site, camera: Camera | None, form: Form, status: int = 200
) -> Response:
    crumbs = [
        {"label": "Sites", "href": "/sites"},
        {"label": site.name, "href": f"/sites/{site.id}"},
    ]
    if camera is None:
        crumbs.append({"label": "New camera"})
    else:
        crumbs += [{"label": camera.name, "href": f"/cameras/{camera.id}"}, {"label": "Edit"}]
    return page(
        request,
        "sites/camera_edit.html",
        status_code=status,
        crumbs=crumbs,
        site=site,
        camera=camera,
        form=form,
    )
