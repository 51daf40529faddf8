"""Pages of evaluation: how far the review is, what it says, and the paper's matching table.

All share a frame with the same filters, which stand in the URL. They refresh themselves by fetching
the same address again; so what is shown live is rendered in one place only.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.dependencies import SessionDep
from app.domain.guideline import current_guideline
from app.domain.matching_table import RESULT_LABELS, Result
from app.evaluation import matching_schemas, queue_repository, review_schemas, selection
from app.evaluation.agreement_figures import agreement_figures
from app.evaluation.breakdown import By
from app.evaluation.matching import matching_figures
from app.evaluation.review_figures import review_figures
from app.evaluation.review_progress import review_progress
from app.evaluation.router import AskedDep, BinWidth, Reader, viewer_of
from app.evaluation.schemas import describe, sample_of
from app.evaluation.selection import Asked, Selection
from app.runs import service as runs
from app.sites import service as sites
from app.tables.queues import QueueUnit
from app.tables.reviews import Grade
from app.templating import page

router = APIRouter()

SECTIONS = (
    ("Overview", "/evaluation"),
    ("Progress", "/evaluation/progress"),
    ("Reviews", "/evaluation/reviews"),
    ("Matching", "/evaluation/matching"),
    ("Projection", "/evaluation/projection"),
    ("Detectors", "/evaluation/detectors"),
    ("IoU by grade", "/evaluation/iou"),
    ("Poses", "/evaluation/poses"),
    ("Runs compared", "/evaluation/runs"),
)
BY_NAMES = {
    By.TYPE: "Vessel type",
    By.RANGE: "Range",
    By.HEADING: "Heading to camera",
    By.RUN: "Run",
    By.REVIEWER: "Reviewer",
}
_GUIDE = current_guideline()
_REASONS = (*_GUIDE.shape_reasons, *_GUIDE.match_reasons)
PercentPoints = Annotated[float, Query(gt=0, lt=50, description="Percentage points")]


@dataclass(frozen=True, slots=True)
class Frame:
    """What every page of evaluation shows around its figures."""

    tabs: Sequence[dict[str, object]]
    query: str
    runs: Sequence[tuple[object, str]]
    queues: Sequence[tuple[object, str]]
    place: str
    run_label: str
    may_review: bool


def show_in_frame(
    request: Request,
    session: Session,
    access: Access,
    chosen: Selection,
    template: str,
    *,
    unit: QueueUnit | None = None,
    **context: object,
) -> Response:
    """Render a page in the frame; `unit`: offer only queues of this unit as samples."""
    query = chosen.asked.query()
    names = {href: name for name, href in SECTIONS}
    crumbs = [{"label": "Evaluation", "href": f"/evaluation{query}"}]
    if request.url.path != "/evaluation":
        crumbs.append({"label": names[request.url.path]})
    return page(
        request,
        template,
        status_code=200,
        crumbs=crumbs,
        asked=chosen.asked,
        frame=_frame(session, access, chosen, request.url.path, unit),
        **context,
    )


def _frame(
    session: Session, access: Access, chosen: Selection, path: str, unit: QueueUnit | None
) -> Frame:
    asked = chosen.asked
    newest = runs.newest_runs(session, access.site_ids(Scope.READ))
    samples = queue_repository.queues(session, [asked.run_id]) if asked.run_id else []
    return Frame(
        tabs=[
            {"label": name, "href": href + asked.query(), "current": path == href}
            for name, href in SECTIONS
        ],
        query=asked.query(),
        runs=[
            ("", "All runs"),
            *((run.id, f"{runs.label(run)} ({done.poses} poses)") for run, done in newest),
        ],
        queues=[
            ("", "No, all of it"),
            *(
                (queue.id, f"No. {queue.id}: {describe(queue)}")
                for queue in samples
                if unit is None or queue.unit is unit
            ),
        ],
        place=_place(session, chosen),
        run_label=runs.label(runs.get_run(session, asked.run_id)) if asked.run_id else "",
        may_review=access.may(Scope.REVIEW, chosen.site_id),
    )


def _place(session: Session, chosen: Selection) -> str:
    """Say in words which place the filters limit to, where they do."""
    asked = chosen.asked
    if asked.viewport_id is not None:
        return f"viewport no. {asked.viewport_id}"
    if asked.camera_id is not None:
        return f"camera {sites.get_camera(session, asked.camera_id).name}"
    if asked.site_id is not None:
        return f"site {sites.get_site(session, asked.site_id).name}"
    return ""


def _show_progress(
    request: Request, session: Session, access: Access, asked: Asked, template: str
) -> Response:
    chosen = selection.select(session, access, asked)
    progress = review_progress(session, chosen, access.user_id)
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        template,
        progress=review_schemas.progress_out(progress),
    )


@router.get("/evaluation")
def show_overview(
    request: Request, session: SessionDep, access: Reader, asked: AskedDep
) -> Response:
    """Show what can be evaluated, and how far the review is."""
    return _show_progress(request, session, access, asked, "evaluation/overview.html")


@router.get("/evaluation/progress")
def show_progress(
    request: Request, session: SessionDep, access: Reader, asked: AskedDep
) -> Response:
    """Show how far a review is, filling as people grade."""
    return _show_progress(request, session, access, asked, "evaluation/progress.html")


@router.get("/evaluation/reviews")
def show_reviews(
    request: Request,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    by: By = By.TYPE,
    bin_m: BinWidth = 200,
    half_width: PercentPoints = 3.0,
) -> Response:
    """Show how poses were judged, how sure that is, and how far reviewers agree."""
    chosen = selection.select(session, access, asked)
    viewer = viewer_of(access, chosen)
    figures = review_figures(
        session, chosen, viewer, by=by, bin_m=bin_m, half_width=half_width / 100
    )
    agreement = agreement_figures(session, chosen, viewer)
    more = {"by": by.value, "bin_m": bin_m}
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/reviews.html",
        figures=review_schemas.figures_out(figures, agreement, sample_of(chosen)),
        by=by.value,
        by_name=BY_NAMES[by],
        bin_m=bin_m,
        half_width=half_width,
        ways=[
            {
                "label": name,
                "href": asked.query(by=way.value, bin_m=bin_m, half_width=half_width),
                "current": way is by,
            }
            for way, name in BY_NAMES.items()
        ],
        grades=[grade.value for grade in Grade],
        reason_names={rule.code: rule.name for rule in _REASONS},
        rest=f"/api/v1/evaluation/reviews{asked.query(**more, half_width=half_width / 100)}",
        csv=f"/api/v1/evaluation/reviews{asked.query(**more, format='csv')}",
    )


@router.get("/evaluation/matching")
def show_matching(
    request: Request, session: SessionDep, access: Reader, asked: AskedDep
) -> Response:
    """Show the paper's matching table from reviews, its own figures beside ours."""
    chosen = selection.select(session, access, asked)
    table = matching_schemas.matching_out(matching_figures(session, chosen), sample_of(chosen))
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/matching.html",
        unit=QueueUnit.IMAGE,
        table=table,
        groups=[
            (RESULT_LABELS[result], [row for row in table.rows if row.result is result])
            for result in Result
        ],
        rest=f"/api/v1/evaluation/matching{asked.query()}",
        csv=f"/api/v1/evaluation/matching{asked.query(format='csv')}",
    )
