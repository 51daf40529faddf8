"""REST of runs: start, list, watch, cancel."""

import json
import threading
from collections.abc import AsyncIterator
from dataclasses import asdict
from typing import Annotated

import anyio
from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import StreamingResponse
from sqlalchemy.orm import Session
from starlette.datastructures import Headers

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.authentication import access_now
from app.auth.idempotency import IdempotentRoute
from app.clocks import service as clocks
from app.clocks.schemas import WithheldOut
from app.db import Database
from app.dependencies import DatabaseDep, JobsDep, Page, PagingDep, SessionDep
from app.errors import NotFound, looked_up_by
from app.ids import RowId
from app.runs import actions, service
from app.runs.parameters import require_used
from app.runs.schemas import RunIn, RunOut
from app.sites import service as sites
from app.tables.runs import Run

router = APIRouter(tags=["runs"], route_class=IdempotentRoute)
EVENT_INTERVAL_S = 0.5
KEEP_ALIVE_S = 15.0

Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.post("/runs", status_code=201)
def start_run(
    body: RunIn,
    session: SessionDep,
    jobs: JobsDep,
    access: Operator,
    response: Response,
) -> RunOut:
    """Start a run over all images of a viewport; a worker takes it from the queue."""
    with looked_up_by("viewport_id"):
        access.require(Scope.INGEST, sites.site_id_of_viewport(session, body.viewport_id))
    require_used(body.preset, body.parameters)
    run = service.start_run(
        session,
        jobs,
        viewport_id=body.viewport_id,
        detector=body.detector,
        preset=body.preset,
        parameters=body.parameters,
        name=body.name,
        user_id=access.user_id,
    )
    record(session, access, "start", "run", run.id, site_id=run.site_id)
    response.headers["Location"] = f"/api/v1/runs/{run.id}"
    return RunOut.of(run, service.progress(session, run))


@router.get("/runs")
def list_runs(
    session: SessionDep, access: Reader, paging: PagingDep, viewport_id: RowId | None = None
) -> Page[RunOut]:
    """List the runs of the sites one may read, oldest first."""
    runs, cursor = service.list_runs(session, access.site_ids(Scope.READ), viewport_id, paging)
    return Page(
        items=[RunOut.of(run, progress) for run, progress in service.with_progress(session, runs)],
        next_cursor=cursor,
    )


@router.get("/runs/{run_id}")
def get_run(run_id: int, session: SessionDep, access: Reader) -> RunOut:
    """Return a run and how far it is."""
    run = service.get_run(session, run_id)
    access.require(Scope.READ, run.site_id)
    return _shown(session, run)


@router.post("/runs/{run_id}/cancel")
def cancel_run(run_id: int, database: DatabaseDep, jobs: JobsDep, access: Operator) -> RunOut:
    """Stop a run before its next images; what it made stays. An ended run stays as it is."""
    with database.reading() as session:
        run = service.get_run(session, run_id)
        access.require(Scope.INGEST, run.site_id)
    if run.status not in service.ENDED:
        # Before any row is written here: the job engine writes on a connection of its own.
        jobs.cancel(run.workflow_id)
        with database.writing() as session:
            if service.mark_cancelled(session, run):
                record(session, access, "cancel", "run", run.id, site_id=run.site_id)
    with database.reading() as session:
        return _shown(session, service.get_run(session, run_id))


@router.post("/runs/{run_id}/again", status_code=201)
def repeat_run(
    run_id: int, session: SessionDep, jobs: JobsDep, access: Operator, response: Response
) -> RunOut:
    """Start the same run anew on the newest registration; detections are used again."""
    old = service.get_run(session, run_id)
    access.require(Scope.INGEST, old.site_id)
    run = service.start_again(session, jobs, old, user_id=access.user_id)
    record(session, access, "start", "run", run.id, site_id=run.site_id, like=old.id)
    response.headers["Location"] = f"/api/v1/runs/{run.id}"
    return RunOut.of(run, service.progress(session, run))


@router.delete("/runs/{run_id}", status_code=204)
def delete_run(run_id: int, session: SessionDep, access: Operator) -> None:
    """Delete an ended run with its poses and reviews; it can be restored for 30 days."""
    run = actions.run_for(session, access, Scope.INGEST, run_id)
    actions.delete_run(session, access, run)


def _shown(session: Session, run: Run) -> RunOut:
    return RunOut.of(
        run,
        service.progress(session, run),
        service.image_errors(session, run.id),
        [WithheldOut.of(row) for row in clocks.suspicions(session, run.id)],
    )


@router.get(
    "/runs/{run_id}/events",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/event-stream": {}}}},
)
def watch_run(
    run_id: int, request: Request, session: SessionDep, database: DatabaseDep, access: Reader
) -> StreamingResponse:
    """Send server-sent events `progress` until the run has ended, then one `end`."""
    run = service.get_run(session, run_id)
    access.require(Scope.READ, run.site_id)
    return StreamingResponse(
        _events(request, database, run_id),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
    )


async def _events(request: Request, database: Database, run_id: int) -> AsyncIterator[str]:
    last, sent_at = "", anyio.current_time()
    leaving: threading.Event = request.app.state.leaving
    while not leaving.is_set() and not await request.is_disconnected():
        progress = await run_in_threadpool(_progress, database, request.headers, run_id)
        if progress is None:
            return
        data = json.dumps(asdict(progress))
        if data != last:
            yield f"event: progress\ndata: {data}\n\n"
            last, sent_at = data, anyio.current_time()
        if progress.status in service.ENDED:
            yield f"event: end\ndata: {data}\n\n"
            return
        if anyio.current_time() - sent_at > KEEP_ALIVE_S:
            yield ": still here\n\n"  # a comment, so that no proxy takes silence for the end
            sent_at = anyio.current_time()
        await anyio.sleep(EVENT_INTERVAL_S)


def _progress(database: Database, headers: Headers, run_id: int) -> service.Progress | None:
    """Return how far a run is; None where it is gone, or who watches may see it no longer."""
    access = access_now(database, headers)
    with database.reading() as session:
        try:
            run: Run = service.get_run(session, run_id)
        except NotFound:
            return None
        may_watch = access is not None and access.may(Scope.READ, run.site_id)
        return service.progress(session, run) if may_watch else None
