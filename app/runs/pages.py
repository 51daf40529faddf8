"""Pages of runs: start one, see them all, watch one."""

import json
from typing import Annotated

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.clocks import service as clocks
from app.dependencies import DatabaseDep, JobsDep, SessionDep
from app.domain.fusion_settings import PRESET_OF_RUNS
from app.errors import AppError, Conflict, Invalid
from app.reviews import service as reviews
from app.runs import emptiness, references, service, setting_words
from app.runs.parameters import require_used
from app.sites import service as sites
from app.templating import page

router = APIRouter()

SHOWN_FIELDS = frozenset({"viewport_id", "detector", "score_threshold", "maximum_cost"})

Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.get("/runs")
def list_runs(request: Request, session: SessionDep, access: Reader) -> Response:
    """List the newest runs."""
    runs = service.newest_runs(session, access.site_ids(Scope.READ))
    verdicts = reviews.verdicts_by_run(session, [run.id for run, _ in runs])
    return page(
        request,
        "runs/list.html",
        crumbs=[{"label": "Runs"}],
        runs=[(run, progress, verdicts[run.id]) for run, progress in runs],
        may_start=access.may_anywhere(Scope.INGEST),
        reviewable=access.site_ids(Scope.REVIEW),
    )


@router.get("/runs/new")
def new_run(
    request: Request, session: SessionDep, access: Operator, viewport_id: int | None = None
) -> Response:
    """Show the form that starts a run."""
    return _form(request, session, access, viewport_id=viewport_id)


@router.post("/runs")
def start_run(
    request: Request,
    database: DatabaseDep,
    jobs: JobsDep,
    access: Operator,
    viewport_id: Annotated[int, Form()],
    detector: Annotated[str, Form()],
    preset: Annotated[str, Form()] = PRESET_OF_RUNS.value,
    name: Annotated[str, Form(max_length=200)] = "",
    matching: Annotated[str, Form()] = "",
    track_method: Annotated[str, Form()] = "",
    decoding_divisor: Annotated[str, Form()] = "",
    score_threshold: Annotated[str, Form()] = "",
    maximum_cost: Annotated[str, Form()] = "",
) -> Response:
    """Start a run and show it; a wrong form comes back as it was entered."""
    entered = {
        "matching": matching,
        "track_method": track_method,
        "decoding_divisor": decoding_divisor,
        "score_threshold": score_threshold,
        "maximum_cost": maximum_cost,
    }
    try:
        with database.writing() as session:
            access.require(Scope.INGEST, sites.site_id_of_viewport(session, viewport_id))
            parameters = {key: _value(text) for key, text in entered.items() if text.strip()}
            require_used(preset, parameters)
            run = service.start_run(
                session,
                jobs,
                viewport_id=viewport_id,
                detector=detector,
                preset=preset,
                parameters=parameters,
                name=name.strip(),
                user_id=access.user_id,
            )
            record(session, access, "start", "run", run.id, site_id=run.site_id)
    except (Conflict, Invalid) as error:
        with database.reading() as session:
            return _form(
                request,
                session,
                access,
                viewport_id=viewport_id,
                detector=detector,
                preset=preset,
                name=name,
                entered=entered,
                error=error,
            )
    return RedirectResponse(f"/runs/{run.id}", status_code=303)


@router.post("/runs/{run_id}/again")
def start_again(run_id: int, database: DatabaseDep, jobs: JobsDep, access: Operator) -> Response:
    """Start the same run anew on the newest registration and show it."""
    with database.writing() as session:
        old = service.get_run(session, run_id)
        access.require(Scope.INGEST, old.site_id)
        run = service.start_again(session, jobs, old, user_id=access.user_id)
        record(session, access, "start", "run", run.id, site_id=run.site_id, like=old.id)
    return RedirectResponse(f"/runs/{run.id}", status_code=303)


def _value(text: str) -> object:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def _form(
    request: Request,
    session: Session,
    access: Access,
    *,
    viewport_id: int | None,
    detector: str = "",
    preset: str = PRESET_OF_RUNS,
    name: str = "",
    entered: dict[str, str] | None = None,
    error: AppError | None = None,
) -> Response:
    wrong = error.fields if error else ()
    errors = {field.field.removeprefix("parameters."): field.message for field in wrong}
    return page(
        request,
        "runs/new.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "Runs", "href": "/runs"}, {"label": "New run"}],
        viewports=service.runnable_viewports(session, access.site_ids(Scope.INGEST)),
        models=service.ready_models(session),
        viewport_id=viewport_id,
        detector=detector,
        preset=preset,
        name=name,
        words=setting_words,
        entered=entered or {},
        errors=errors,
        message=error.detail if error and not errors.keys() & SHOWN_FIELDS else "",
    )


@router.get("/runs/{run_id}")
def show_run(request: Request, run_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a run: how far it is, what it is made of, how its poses were judged."""
    run = service.get_run(session, run_id)
    access.require(Scope.READ, run.site_id)
    progress = service.progress(session, run)
    return page(
        request,
        "runs/run.html",
        crumbs=[{"label": "Runs", "href": "/runs"}, {"label": service.label(run)}],
        run=run,
        settings=setting_words.shown(run.parameters),
        label=service.label(run),
        site=sites.get_site(session, run.site_id),
        progress=progress,
        watched={
            "id": run.id,
            "status": run.status.value,
            "images_done": progress.images_done,
            "images_total": progress.images_total,
            "detections": progress.detections,
            "poses": progress.poses,
        },
        emptiness=emptiness.reason(session, run, progress),
        verdicts=reviews.verdicts(session, run.id),
        outcomes=service.outcomes(session, run.id),
        image_errors=service.image_errors(session, run.id),
        suspicions=clocks.suspicions(session, run.id),
        may_correct=access.may(Scope.REGISTER, run.site_id),
        may_cancel=access.may(Scope.INGEST, run.site_id),
        may_review=access.may(Scope.REVIEW, run.site_id),
        may_export=access.may(Scope.EXPORT, run.site_id),
        reference=references.reference_of(session, run.site_id),
        reference_version=references.version(session, run.site_id),
    )


@router.post("/runs/{run_id}/reference")
def choose_reference(
    run_id: int,
    database: DatabaseDep,
    access: Operator,
    version: Annotated[int, Form()] = references.NONE_YET,
    is_reference: Annotated[bool, Form()] = True,  # noqa: FBT002  a field of a form
) -> Response:
    """Name a run its site's reference, or take the name back, and show the run."""
    with database.writing() as session:
        run = service.get_run(session, run_id)
        access.require(Scope.INGEST, run.site_id)
        references.check_version(session, run.site_id, version)
        references.choose(session, access, run.site_id, run_id if is_reference else None)
    return RedirectResponse(f"/runs/{run_id}", status_code=303)
