"""The page of a live camera: how photographs come by themselves, and what is done with them."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.live import actions, folders, standing
from app.live.schemas import FolderIn, StandingIn
from app.paging import Paging
from app.registration import service as registration
from app.runs import service as runs
from app.runs.setting_words import PRESETS
from app.sites import actions as sites
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Ingester = Annotated[Access, allowed(Scope.INGEST)]
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
ALL = Paging(limit=1000, after=None)
EMPTY = Form()


@router.get("/cameras/{camera_id:int}/live")
def show_live(request: Request, camera_id: int, session: SessionDep, access: Reader) -> Response:
    """Show what goes on by itself with a camera."""
    return _live_page(request, session, access, camera_id, EMPTY)


@router.post("/cameras/{camera_id:int}/watched-folders")
def add_folder(
    request: Request,
    camera_id: int,
    database: DatabaseDep,
    access: Administrator,
    entered: Submitted,
) -> Response:
    """Watch a folder and show the camera's live page."""
    try:
        data = parse(FolderIn, entered)
        with database.writing() as session:
            actions.add_folder(session, access, camera_id, data)
    except ENTRY_ERRORS as error:
        return _again(request, database, access, camera_id, rejected(entered, error), error.status)
    return _back(camera_id)


@router.post("/watched-folders/{folder_id:int}/pause")
def pause_folder(folder_id: int, session: SessionDep, access: Ingester) -> Response:
    """Pause a folder."""
    return _back(actions.pause_folder(session, access, folder_id, paused=True).camera_id)


@router.post("/watched-folders/{folder_id:int}/resume")
def resume_folder(folder_id: int, session: SessionDep, access: Ingester) -> Response:
    """Watch a folder again."""
    return _back(actions.pause_folder(session, access, folder_id, paused=False).camera_id)


@router.post("/cameras/{camera_id:int}/drop-tokens")
def make_drop_token(
    request: Request, camera_id: int, database: DatabaseDep, access: Ingester
) -> Response:
    """Make a token for dropping photographs and show it this once."""
    with database.writing() as session:
        camera = sites.camera_for(session, access, Scope.INGEST, camera_id)
        _, text = actions.make_drop_token(session, access, camera)
    with database.reading() as session:
        return _live_page(request, session, access, camera_id, EMPTY, token=text)


@router.post("/cameras/{camera_id:int}/standing-runs")
def add_standing_run(
    request: Request, camera_id: int, database: DatabaseDep, access: Ingester, entered: Submitted
) -> Response:
    """Start a standing run and show the camera's live page."""
    try:
        data = parse(StandingIn, entered)
        with database.writing() as session:
            sites.camera_for(session, access, Scope.INGEST, camera_id)
            actions.add_standing(session, access, data)
    except ENTRY_ERRORS as error:
        return _again(request, database, access, camera_id, rejected(entered, error), error.status)
    return _back(camera_id)


@router.post("/standing-runs/{standing_id:int}/pause")
def pause_standing_run(standing_id: int, session: SessionDep, access: Ingester) -> Response:
    """Pause a standing run."""
    row = actions.pause_standing(session, access, standing_id, paused=True)
    return _back(row.viewport.camera_id)


@router.post("/standing-runs/{standing_id:int}/resume")
def resume_standing_run(standing_id: int, session: SessionDep, access: Ingester) -> Response:
    """Let a standing run go on."""
    row = actions.pause_standing(session, access, standing_id, paused=False)
    return _back(row.viewport.camera_id)


@router.post("/standing-runs/{standing_id:int}/delete")
def remove_standing_run(standing_id: int, session: SessionDep, access: Ingester) -> Response:
    """End a standing run, after it was asked."""
    actions.remove_standing(session, access, standing_id)
    return RedirectResponse("/deletions", status_code=303)


@router.post("/watched-folders/{folder_id:int}/delete")
def remove_folder(folder_id: int, session: SessionDep, access: Ingester) -> Response:
    """Watch a folder no longer, after it was asked."""
    actions.remove_folder(session, access, folder_id)
    return RedirectResponse("/deletions", status_code=303)


def _back(camera_id: int) -> Response:
    return RedirectResponse(f"/cameras/{camera_id}/live", status_code=303)


def _again(
    request: Request,
    database: DatabaseDep,
    access: Access,
    camera_id: int,
    form: Form,
    status: int,
) -> Response:
    with database.reading() as session:
        return _live_page(request, session, access, camera_id, form, status=status)


def _live_page(
    request: Request,
    session: SessionDep,
    access: Access,
    camera_id: int,
    form: Form,
    *,
    token: str = "",
    status: int = 200,
) -> Response:
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    readable = access.site_ids(Scope.READ)
    standing_runs, _ = standing.listed(session, readable, ALL, camera.id)
    viewports, _ = registration.list_viewports(session, readable, ALL, camera_id=camera.id)
    ran = {row.run_id for row in standing_runs if row.run_id is not None}
    found = runs.with_progress(session, [runs.get_run(session, run_id) for run_id in sorted(ran)])
    return page(
        request,
        "live/live.html",
        status_code=status,
        crumbs=[
            {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
            {"label": camera.name, "href": f"/cameras/{camera.id}"},
            {"label": "Live"},
        ],
        camera=camera,
        folders=[
            (row, folders.counts(session, row.id), folders.refused(session, row.id))
            for row in folders.of_camera(session, camera.id)
        ],
        standing_runs=standing_runs,
        progress={run.id: progress for run, progress in found},
        viewports=[(viewport.id, viewport.name) for viewport in viewports],
        models=runs.ready_models(session),
        presets=[(preset.value, text) for preset, text in PRESETS.items()],
        form=form,
        token=token,
        drop_url=f"{request.url.scheme}://{request.url.netloc}/api/v1/cameras/{camera.id}/drop",
        may_ingest=access.may(Scope.INGEST, camera.site_id),
        may_watch=access.is_admin,
    )
