"""The page of a site's water level: its series drawn, its gaps, and a form to replace it."""

from typing import Annotated

from fastapi import APIRouter, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from pydantic import BaseModel, Field

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep
from app.errors import Invalid, TooLarge
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.sites import actions, water, water_actions
from app.sites.fields import HIGHEST_M
from app.sites.water_csv import parse_levels
from app.sites.water_drawing import HEIGHT_PX, WIDTH_PX, draw
from app.sites.water_router import MOST_BYTES, SeriesOut
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


class _Entered(BaseModel):
    offset_m: float = Field(0.0, ge=-HIGHEST_M, le=HIGHEST_M)


@router.get("/sites/{site_id:int}/water-levels")
def show_levels(request: Request, site_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a site's water level."""
    return _page(request, session, access, site_id, Form({"offset_m": "0"}))


@router.post("/sites/{site_id:int}/water-levels")
def replace_levels(
    request: Request,
    site_id: int,
    database: DatabaseDep,
    access: Registrar,
    entered: Submitted,
    file: UploadFile | None = None,
) -> Response:
    """Replace a site's series by an uploaded table."""
    with database.reading() as session:
        site = actions.site_for(session, access, Scope.REGISTER, site_id)
    try:
        offset_m = parse(_Entered, {"offset_m": entered.get("offset_m", "")}).offset_m
        readings = parse_levels(_text_of(file), site.timezone, offset_m)
    except (*ENTRY_ERRORS, TooLarge) as error:
        form = rejected({"table": "", "offset_m": "0"} | entered, error)
        with database.reading() as session:
            return _page(request, session, access, site_id, form, error.status)
    with database.writing() as session:
        site = actions.site_for(session, access, Scope.REGISTER, site_id)
        water_actions.replace(session, access, site, readings)
    return RedirectResponse(f"/sites/{site_id}/water-levels", status_code=303)


@router.post("/sites/{site_id:int}/water-levels/delete")
def delete_levels(site_id: int, session: SessionDep, access: Registrar) -> Response:
    """Remove a site's series."""
    site = actions.site_for(session, access, Scope.REGISTER, site_id)
    water_actions.remove(session, access, site)
    return RedirectResponse("/deletions", status_code=303)


def _text_of(file: UploadFile | None) -> str:
    if file is None or not file.size:
        raise Invalid.field("table", "choose a CSV file")
    data = file.file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise TooLarge(f"a series has at most {MOST_BYTES} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Invalid.field("table", "is no text in UTF-8; save it as CSV UTF-8") from error


def _page(
    request: Request,
    session: SessionDep,
    access: Access,
    site_id: int,
    form: Form,
    status: int = 200,
) -> Response:
    site = actions.site_for(session, access, Scope.READ, site_id)
    series = water.series_of(session, site)
    return page(
        request,
        "sites/water.html",
        status_code=status,
        crumbs=[
            {"label": "Sites", "href": "/sites"},
            {"label": site.name, "href": f"/sites/{site.id}"},
            {"label": "Water level"},
        ],
        site=site,
        summary=SeriesOut.of(site.water_level_m, series),
        drawing=draw(series),
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        form=form,
        may_register=access.may(Scope.REGISTER, site.id),
    )
