"""The review page of a run."""

from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.domain.grading import GUIDELINE, GUIDELINE_VERSION
from app.errors import NotFound
from app.guideline import service as guideline
from app.ids import RowId
from app.reviews import queue_pages, queues
from app.runs import service as runs
from app.templating import page

router = APIRouter()
router.include_router(queue_pages.router)


@router.get("/runs/{run_id}/review")
def review_run(
    request: Request,
    run_id: int,
    session: SessionDep,
    access: Annotated[Access, allowed(Scope.REVIEW)],
    queue: RowId | None = None,
) -> Response:
    """Show the poses of a run to be graded, one after the other; those of a queue where named."""
    run = runs.get_run(session, run_id)
    access.require(Scope.REVIEW, run.site_id)
    if queue is not None and queues.get(session, queue).run_id != run_id:
        raise NotFound(queues.NO_QUEUE)
    label = runs.label(run)
    return page(
        request,
        "review/review.html",
        crumbs=[
            {"label": "Runs", "href": "/runs"},
            {"label": label, "href": f"/runs/{run_id}"},
            {"label": "Review"},
        ],
        run_id=run_id,
        run_label=label,
        queue_id=queue,
        time_zone=run.viewport.camera.timezone,
        guideline=GUIDELINE,
        guideline_version=GUIDELINE_VERSION,
        guideline_text=guideline.current(),
    )
