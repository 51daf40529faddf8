"""The page of a camera's clock: its history, a correction by hand, and what images say."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.clocks import actions, service
from app.clocks.schemas import EstimateIn, OffsetIn
from app.dependencies import DatabaseDep, JobsDep, SessionDep
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.runs import service as runs
from app.sites import actions as sites
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
EMPTY = Form()


@router.get("/cameras/{camera_id:int}/clock")
def show_clock(request: Request, camera_id: int, session: SessionDep, access: Reader) -> Response:
    """Show how far a camera's clock was off, and when."""
    return _clock_page(request, session, access, camera_id, EMPTY)


@router.post("/cameras/{camera_id:int}/clock-offsets")
def add_offset(
    request: Request, camera_id: int, database: DatabaseDep, access: Registrar, entered: Submitted
) -> Response:
    """Correct a clock by hand or by an estimate, and show the history."""
    try:
        data = parse(OffsetIn, entered)
        with database.writing() as session:
            camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
            actions.add_offset(session, access, camera, data)
    except ENTRY_ERRORS as error:
        return _again(request, database, access, camera_id, rejected(entered, error), error.status)
    return RedirectResponse(f"/cameras/{camera_id}/clock", status_code=303)


@router.post("/clock-offsets/{offset_id:int}/undo")
def undo_offset(offset_id: int, session: SessionDep, access: Registrar) -> Response:
    """Take a correction back and show the history."""
    row = actions.undo(session, access, offset_id)
    return RedirectResponse(f"/cameras/{row.camera_id}/clock", status_code=303)


@router.post("/cameras/{camera_id:int}/clock-estimates")
def start_estimate(
    request: Request,
    camera_id: int,
    database: DatabaseDep,
    jobs: JobsDep,
    access: Registrar,
    entered: Submitted,
) -> Response:
    """Ask a run's images for the clock."""
    try:
        data = parse(EstimateIn, entered)
        with database.writing() as session:
            camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
            actions.start_estimate(session, jobs, access, camera, data)
    except ENTRY_ERRORS as error:
        return _again(request, database, access, camera_id, rejected(entered, error), error.status)
    return RedirectResponse(f"/cameras/{camera_id}/clock", status_code=303)


def _again(
    request: Request,
    database: DatabaseDep,
    access: Access,
    camera_id: int,
    form: Form,
    status: int,
) -> Response:
    with database.reading() as session:
        return _clock_page(request, session, access, camera_id, form, status)


def _clock_page(
    request: Request,
    session: SessionDep,
    access: Access,
    camera_id: int,
    form: Form,
    status: int = 200,
) -> Response:
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    site = {"label": camera.site.name, "href": f"/sites/{camera.site_id}"}
    place = {"label": camera.name, "href": f"/cameras/{camera.id}"}
    return page(
        request,
        "clocks/clock.html",
        status_code=status,
        crumbs=[site, place, {"label": "Clock"}],
        camera=camera,
        history=service.history(session, camera.id),
        estimates=service.estimates(session, camera.id),
        runs=[(run.id, runs.label(run)) for run in service.runs_to_ask(session, camera.id)],
        form=form,
        may_correct=access.may(Scope.REGISTER, camera.site_id),
    )
