"""Pages of re-registrations: start one, watch it, look at a pointing before and after, decide."""

import json
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, JobsDep, SessionDep
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.ids import RowId
from app.registration import actions as registration
from app.reregistration import accepting, actions, service
from app.reregistration.overlay import overlay_of
from app.reregistration.schemas import (
    AcceptIn,
    PointingOut,
    ReregistrationIn,
    TurnedImageOut,
)
from app.tables.reregistration import Pointing, PointingState, Reregistration
from app.tables.sites import Camera, Viewport
from app.templating import page

router = APIRouter()
MOST_SHOWN = 500
FIELDS = frozenset(ReregistrationIn.model_fields) | {"from", "until"}

Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.get("/viewports/{viewport_id:int}/reregistrations")
def list_reregistrations(
    request: Request, viewport_id: int, session: SessionDep, access: Reader
) -> Response:
    """Show a viewport's re-registrations and the form that starts one."""
    viewport = registration.viewport_for(session, access, Scope.READ, viewport_id)
    return _list_page(request, session, access, viewport, Form({"images": "unassigned"}))


@router.post("/viewports/{viewport_id:int}/reregistrations")
def start(
    request: Request,
    viewport_id: int,
    database: DatabaseDep,
    jobs: JobsDep,
    access: Registrar,
    entered: Submitted,
) -> Response:
    """Start a re-registration and show it."""
    try:
        asked = {name: value for name, value in entered.items() if name in FIELDS}
        data = parse(ReregistrationIn, asked)
        with database.writing() as session:
            row = actions.start(session, jobs, access, viewport_id, data)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            viewport = registration.viewport_for(session, access, Scope.REGISTER, viewport_id)
            form = rejected(entered, error)
            return _list_page(request, session, access, viewport, form, error.status)
    return RedirectResponse(f"/reregistrations/{row.id}", status_code=303)


@router.get("/reregistrations/{reregistration_id:int}")
def show(request: Request, reregistration_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a re-registration: how far it is, what it proposes, which images it leaves alone."""
    row = actions.reregistration_for(session, access, Scope.READ, reregistration_id)
    (shown,) = service.shown(session, [row])
    pointings = service.pointings(session, row.id)
    refused = service.images(session, row.id, passed=False, limit=MOST_SHOWN)
    passed = service.images(session, row.id, passed=True, limit=MOST_SHOWN)
    return page(
        request,
        "reregistration/show.html",
        crumbs=[*_crumbs(row.viewport), {"label": f"Re-registration {row.id}"}],
        row=row,
        shown=shown,
        site=row.viewport.camera.site,
        pointings=[PointingOut.of(found) for found in pointings],
        passed=[TurnedImageOut.of(image) for image in passed],
        refused=[TurnedImageOut.of(image) for image in refused],
        ended=row.status in service.ENDED,
        may_register=access.may(Scope.REGISTER, row.site_id),
    )


@router.post("/reregistrations/{reregistration_id:int}/cancel")
def cancel(
    reregistration_id: int, database: DatabaseDep, jobs: JobsDep, access: Registrar
) -> Response:
    """Stop a re-registration and show it."""
    actions.cancel(database, jobs, access, reregistration_id)
    return RedirectResponse(f"/reregistrations/{reregistration_id}", status_code=303)


@router.get("/pointings/{pointing_id:int}")
def show_pointing(
    request: Request,
    pointing_id: int,
    session: SessionDep,
    access: Reader,
    image_id: RowId | None = None,
) -> Response:
    """Show a pointing's image with landmarks and horizon before and after the turn."""
    pointing = actions.pointing_for(session, access, Scope.READ, pointing_id)
    return _pointing_page(request, session, access, pointing, image_id=image_id)


@router.post("/pointings/{pointing_id:int}/accept")
def accept(
    request: Request, pointing_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Make a pointing a viewport and show that."""
    try:
        asked = {name: entered.get(name, "") for name in AcceptIn.model_fields}
        with database.writing() as session:
            pointing = actions.accept(session, access, pointing_id, parse(AcceptIn, asked))
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            pointing = actions.pointing_for(session, access, Scope.REGISTER, pointing_id)
            form = rejected(entered, error)
            return _pointing_page(request, session, access, pointing, form, error.status)
    return RedirectResponse(f"/viewports/{pointing.viewport_id}", status_code=303)


@router.post("/pointings/{pointing_id:int}/reject")
def reject(
    request: Request, pointing_id: int, database: DatabaseDep, access: Registrar
) -> Response:
    """Put a pointing aside and go back to the list."""
    try:
        with database.writing() as session:
            pointing = actions.reject(session, access, pointing_id)
            parent_id = pointing.reregistration_id
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            pointing = actions.pointing_for(session, access, Scope.REGISTER, pointing_id)
            form = Form(message=error.detail)
            return _pointing_page(request, session, access, pointing, form, error.status)
    return RedirectResponse(f"/reregistrations/{parent_id}", status_code=303)


def _list_page(
    request: Request,
    session: Session,
    access: Access,
    viewport: Viewport,
    form: Form,
    status: int = 200,
) -> Response:
    return page(
        request,
        "reregistration/list.html",
        status_code=status,
        crumbs=[*_crumbs(viewport), {"label": "Re-registration"}],
        viewport=viewport,
        rows=service.shown(session, service.newest(session, viewport.id)),
        form=form,
        may_register=access.may(Scope.REGISTER, viewport.camera.site_id),
    )


def _pointing_page(
    request: Request,
    session: Session,
    access: Access,
    pointing: Pointing,
    form: Form | None = None,
    status: int = 200,
    *,
    image_id: int | None = None,
) -> Response:
    parent: Reregistration = pointing.reregistration
    chosen = service.image_of(session, pointing, image_id)
    members = service.images(session, parent.id, pointing_id=pointing.id, limit=MOST_SHOWN)
    place = [member.image_id for member in members].index(chosen.image_id)
    neighbours = [
        members[index].image_id if 0 <= index < len(members) else None
        for index in (place - 1, place + 1)
    ]
    begin, end = accepting.times_of(session, pointing)
    return page(
        request,
        "reregistration/pointing.html",
        status_code=status,
        crumbs=[
            *_crumbs(parent.viewport),
            {"label": f"Re-registration {parent.id}", "href": f"/reregistrations/{parent.id}"},
            {"label": f"Pointing {pointing.position + 1}"},
        ],
        pointing=PointingOut.of(pointing),
        image=TurnedImageOut.of(chosen),
        place=place + 1,
        neighbours=neighbours,
        overlay=json.dumps(overlay_of(session, chosen, parent)),
        site=parent.viewport.camera.site,
        reference=parent.reference_image,
        form=form or Form(),
        begin=begin,
        end=end,
        is_open=pointing.state is PointingState.PROPOSED,
        may_register=access.may(Scope.REGISTER, parent.site_id),
    )


def _crumbs(viewport: Viewport) -> list[dict[str, str]]:
    camera: Camera = viewport.camera
    return [
        {"label": "Sites", "href": "/sites"},
        {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
        {"label": camera.name, "href": f"/cameras/{camera.id}"},
        {"label": viewport.name, "href": f"/viewports/{viewport.id}"},
    ]
