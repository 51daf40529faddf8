"""Pages of detectors: which there are, which may be used, why the others may not."""

from pathlib import PurePath
from typing import Annotated

from fastapi import APIRouter, Form, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, JobsDep, SessionDep, SettingsDep, StorageDep
from app.detectors import actions, service
from app.detectors.families import AUTO, FAMILIES
from app.errors import AppError
from app.tables.detection import ModelStatus
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.get("/models")
def list_models(request: Request, session: SessionDep, access: Reader) -> Response:
    """Show all models."""
    return _page(request, session, access)


@router.post("/models")
def add_model(
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    storage: StorageDep,
    jobs: JobsDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    name: Annotated[str, Form()] = "",
    family: Annotated[str, Form()] = AUTO,
) -> Response:
    """Add a model, named as its file where no name is given, and show it."""
    called = name.strip() or PurePath(file.filename or "").stem
    try:
        added = actions.add_upload(session, storage, jobs, settings, access, file, called, family)
    except AppError as error:
        session.rollback()
        with database.reading() as reading:
            return _page(request, reading, access, name=name, family=family, model_error=error)
    return RedirectResponse(f"/models/{added.model.id}", status_code=303)


@router.post("/models/imported-detections")
def import_detections(
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    name: Annotated[str, Form()] = "",
    categories: Annotated[str, Form()] = "",
) -> Response:
    """Import detections of another detector and show the model that stands for them."""
    try:
        outcome = actions.import_detections(
            database,
            session,
            settings,
            access,
            file,
            None,
            name=name,
            camera_id=None,
            categories=categories,
        )
    except AppError as error:
        session.rollback()
        with database.reading() as reading:
            return _page(request, reading, access, boxes_name=name, boxes_error=error)
    return RedirectResponse(f"/models/{outcome.model.id}", status_code=303)


@router.get("/models/{model_id:int}")
def show_model(model_id: int, request: Request, session: SessionDep, access: Reader) -> Response:
    """Show a model."""
    return _model_page(request, session, access, model_id)


@router.post("/models/{model_id:int}/delete")
def delete_model(
    model_id: int,
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    access: Operator,
) -> Response:
    """Remove a model that no run uses."""
    try:
        actions.delete_model(session, access, model_id)
    except AppError as error:
        session.rollback()
        with database.reading() as reading:
            return _model_page(request, reading, access, model_id, error=error)
    return RedirectResponse("/deletions", status_code=303)


def _page(
    request: Request,
    session: Session,
    access: Access,
    *,
    name: str = "",
    family: str = AUTO,
    boxes_name: str = "",
    model_error: AppError | None = None,
    boxes_error: AppError | None = None,
) -> Response:
    error = model_error or boxes_error
    return page(
        request,
        "detectors/index.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "Models"}],
        models=service.all_models(session),
        families=[(AUTO, "As its inputs and outputs show"), *FAMILIES.items()],
        imported_family=service.IMPORTED_FAMILY,
        name=name,
        family=family,
        boxes_name=boxes_name,
        may_add=access.may(Scope.INGEST, None),
        may_import=access.may_anywhere(Scope.INGEST),
        flashes=[{"message": f"Not added: {error.detail}", "tone": "error"}] if error else [],
    )


def _model_page(
    request: Request,
    session: Session,
    access: Access,
    model_id: int,
    *,
    error: AppError | None = None,
) -> Response:
    model = service.get_model(session, model_id)
    runs, images = service.count_uses(session, model)
    return page(
        request,
        "detectors/model.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "Models", "href": "/models"}, {"label": model.name}],
        model=model,
        is_imported=model.family == service.IMPORTED_FAMILY,
        is_probing=model.status is ModelStatus.PROBING,
        runs=runs,
        images=images,
        message=error.detail if error else "",
        may_delete=access.may(Scope.INGEST, None) and not runs,
        may_run=access.may_anywhere(Scope.INGEST) and model.status is ModelStatus.READY,
    )
