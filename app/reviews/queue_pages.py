"""The page of a run's queues: choose what to review next, or make a queue of one's own."""

from typing import Annotated, TypeVar

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.dependencies import DatabaseDep, SessionDep
from app.errors import AppError, Invalid
from app.paging import Paging
from app.reviews import queues
from app.reviews import service as reviews
from app.runs import service as runs
from app.tables.queues import QueueOrder, QueueUnit
from app.tables.runs import Run
from app.templating import page

router = APIRouter()

Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
MOST_SHOWN = 50
LARGEST_SAMPLE = 1_000_000
Choice = TypeVar("Choice", QueueUnit, QueueOrder)


@router.get("/runs/{run_id}/queues")
def list_queues(request: Request, run_id: int, session: SessionDep, access: Reviewer) -> Response:
    """Show a run's queues and how far they are, and the form for another."""
    return _page(request, session, _run(session, access, run_id), access)


@router.post("/runs/{run_id}/queues")
def make_queue(
    request: Request,
    run_id: int,
    database: DatabaseDep,
    access: Reviewer,
    unit: Annotated[str, Form()] = QueueUnit.POSE.value,
    order: Annotated[str, Form()] = QueueOrder.TIME.value,
    sample: Annotated[str, Form()] = "",
    seed: Annotated[str, Form()] = "",
    double: Annotated[str, Form()] = "",
) -> Response:
    """Make a queue and begin with it; a wrong form comes back as it was entered."""
    entered = {"unit": unit, "order": order, "sample": sample, "seed": seed, "double": bool(double)}
    try:
        choice = queues.QueueChoice(
            unit=_one_of(QueueUnit, "unit", unit),
            order=_one_of(QueueOrder, "order", order),
            sample=_whole("sample", sample, 1, LARGEST_SAMPLE),
            seed=_whole("seed", seed, 0, queues.LARGEST_SEED),
            double=bool(double),
        )
        with database.writing() as session:
            run = _run(session, access, run_id)
            queue, is_new = queues.create_or_reuse(session, run, choice, access.user_id)
            if is_new:
                record(session, access, "create", "review queue", queue.id, site_id=run.site_id)
            queue_id = queue.id
    except Invalid as error:
        with database.reading() as session:
            return _page(
                request,
                session,
                _run(session, access, run_id),
                access,
                entered=entered,
                error=error,
            )
    return RedirectResponse(f"/runs/{run_id}/review?queue={queue_id}", status_code=303)


def _run(session: Session, access: Access, run_id: int) -> Run:
    run = runs.get_run(session, run_id)
    access.require(Scope.REVIEW, run.site_id)
    return run


def _page(
    request: Request,
    session: Session,
    run: Run,
    access: Access,
    *,
    entered: dict[str, object] | None = None,
    error: AppError | None = None,
) -> Response:
    found, _ = queues.listed(
        session, access.site_ids(Scope.READ), run.id, Paging(limit=MOST_SHOWN, after=None)
    )
    counts = queues.counts(session, found, access.user_id)
    label = runs.label(run)
    return page(
        request,
        "review/queues.html",
        status_code=error.status if error else 200,
        crumbs=[
            {"label": "Runs", "href": "/runs"},
            {"label": label, "href": f"/runs/{run.id}"},
            {"label": "Queues"},
        ],
        run=run,
        label=label,
        verdicts=reviews.verdicts(session, run.id),
        queues=[(queue, queues.describe(queue), counts[queue.id]) for queue in found],
        entered=entered or {},
        errors={field.field: field.message for field in error.fields} if error else {},
    )


def _one_of(kind: type[Choice], field: str, text: str) -> Choice:
    try:
        return kind(text)
    except ValueError:
        options = ", ".join(option.value for option in kind)
        raise Invalid.field(field, f"choose one of: {options}") from None


def _whole(field: str, text: str, least: int, most: int) -> int | None:
    """Read a whole number; nothing for nothing."""
    if not text.strip():
        return None
    if not text.strip().isdecimal() or not least <= int(text) <= most:
        raise Invalid.field(field, f"give a whole number from {least} to {most}")
    return int(text)
