"""Pages of deletions: what goes along, asked before; and what can be brought back."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import RedirectResponse

from app.ais import actions as ais
from app.auth.access import Access, Scope, allowed
from app.deletions import actions, service, things
from app.deletions.schemas import Entity
from app.dependencies import DatabaseDep, SessionDep
from app.errors import Conflict, NotFound
from app.ids import RowId
from app.registration import actions as registration
from app.runs import actions as runs
from app.runs import service as run_service
from app.sites import actions as sites
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
Operator = Annotated[Access, allowed(Scope.INGEST)]
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
DELETED = "/deletions"


@router.get("/deletions")
def show_deletions(request: Request, session: SessionDep, access: Reader) -> Response:
    """Show what was deleted in the last 30 days."""
    return _deleted_page(request, session, access)


@router.post("/deletions/{deletion_id:int}/restore")
def restore(request: Request, deletion_id: int, database: DatabaseDep, access: Reader) -> Response:
    """Bring back what a deletion took and show what is still deleted."""
    try:
        with database.writing() as session:
            actions.restore(session, access, deletion_id)
    except Conflict as error:
        with database.reading() as session:
            return _deleted_page(request, session, access, error)
    return RedirectResponse(DELETED, status_code=303)


def _deleted_page(
    request: Request, session: SessionDep, access: Access, error: Conflict | None = None
) -> Response:
    deletions = service.newest_deletions(session, access.site_ids(Scope.READ))
    return page(
        request,
        "deletions/list.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "Recently deleted"}],
        deletions=[
            (
                deletion,
                service.gone_at(deletion),
                actions.may_restore(access, deletion),
            )
            for deletion in deletions
        ],
        words=things.WORDS,
        message=error.detail if error else "",
    )


@router.get("/deletions/ask")
def ask(
    request: Request,
    session: SessionDep,
    access: Reader,
    entity: Entity,
    identifier: Annotated[RowId, Query(alias="id")],
) -> Response:
    """Say what goes along with one of the smaller things, and ask."""
    thing = things.thing_for(session, access, actions.SCOPES[entity], entity, identifier)
    if not thing.action:
        raise NotFound("this is deleted by REST, or where it was made")
    counts = service.preview(session, entity, [identifier])
    return _ask(
        request,
        things.WORDS.get(entity, entity),
        thing.name,
        thing.place,
        counts,
        action=thing.action,
        stays=thing.stays,
    )


@router.get("/sites/{site_id:int}/delete")
def ask_site(
    request: Request, site_id: int, session: SessionDep, access: Administrator
) -> Response:
    """Say what goes along with a site."""
    site = sites.site_for(session, access, Scope.ADMIN, site_id)
    counts = service.preview(session, "site", [site.id])
    return _ask(request, "site", site.name, f"/sites/{site.id}", counts)


@router.post("/sites/{site_id:int}/delete")
def delete_site(site_id: int, session: SessionDep, access: Administrator) -> Response:
    """Delete a site for 30 days."""
    site = sites.site_for(session, access, Scope.ADMIN, site_id)
    sites.delete_site(session, access, site)
    return RedirectResponse(DELETED, status_code=303)


@router.get("/cameras/{camera_id:int}/delete")
def ask_camera(
    request: Request, camera_id: int, session: SessionDep, access: Registrar
) -> Response:
    """Say what goes along with a camera."""
    camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
    counts = service.preview(session, "camera", [camera.id])
    return _ask(request, "camera", camera.name, f"/cameras/{camera.id}", counts)


@router.post("/cameras/{camera_id:int}/delete")
def delete_camera(camera_id: int, session: SessionDep, access: Registrar) -> Response:
    """Delete a camera for 30 days."""
    camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
    sites.delete_camera(session, access, camera)
    return RedirectResponse(DELETED, status_code=303)


@router.get("/viewports/{viewport_id:int}/delete")
def ask_viewport(
    request: Request, viewport_id: int, session: SessionDep, access: Registrar
) -> Response:
    """Say what goes along with a viewport."""
    viewport = registration.viewport_for(session, access, Scope.REGISTER, viewport_id)
    counts = service.preview(session, "viewport", [viewport.id])
    return _ask(request, "viewport", viewport.name, f"/viewports/{viewport.id}", counts)


@router.post("/viewports/{viewport_id:int}/delete")
def delete_viewport(viewport_id: int, session: SessionDep, access: Registrar) -> Response:
    """Delete a viewport for 30 days."""
    viewport = registration.viewport_for(session, access, Scope.REGISTER, viewport_id)
    registration.delete_viewport(session, access, viewport)
    return RedirectResponse(DELETED, status_code=303)


@router.get("/runs/{run_id:int}/delete")
def ask_run(request: Request, run_id: int, session: SessionDep, access: Operator) -> Response:
    """Say what goes along with a run."""
    run = runs.run_for(session, access, Scope.INGEST, run_id)
    counts = service.preview(session, "run", [run.id])
    return _ask(request, "run", run_service.label(run), f"/runs/{run.id}", counts)


@router.post("/runs/{run_id:int}/delete")
def delete_run(run_id: int, session: SessionDep, access: Operator) -> Response:
    """Delete a run for 30 days."""
    run = runs.run_for(session, access, Scope.INGEST, run_id)
    runs.delete_run(session, access, run)
    return RedirectResponse(DELETED, status_code=303)


@router.get("/ais/files/{file_id:int}/delete")
def ask_recording(
    request: Request, file_id: int, session: SessionDep, access: Operator
) -> Response:
    """Say what goes along with an AIS recording, and what rests on it."""
    file = ais.file_for(session, access, Scope.INGEST, file_id)
    counts = service.preview(session, "ais_file", [file.id])
    stale = run_service.resting_on_recording(session, file.id)
    return _ask(request, "recording", ais.label(file), f"/ais/files/{file.id}", counts, stale)


@router.post("/ais/files/{file_id:int}/delete")
def delete_recording(file_id: int, session: SessionDep, access: Operator) -> Response:
    """Delete an AIS recording for 30 days."""
    file = ais.file_for(session, access, Scope.INGEST, file_id)
    ais.delete_file(session, access, file)
    return RedirectResponse(DELETED, status_code=303)


def _ask(
    request: Request,
    entity: str,
    name: str,
    place: str,
    counts: dict[str, int],
    stale_runs: Sequence[int] = (),
    *,
    action: str = "",
    stays: str = "",
) -> Response:
    return page(
        request,
        "deletions/ask.html",
        crumbs=[{"label": name, "href": place}, {"label": "Delete"}],
        entity=entity,
        name=name,
        place=place,
        action=action or f"{place}/delete",
        stays=stays,
        counts=counts,
        stale_runs=stale_runs,
        kept_days=service.KEPT.days,
    )
