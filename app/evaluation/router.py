"""REST of evaluation: figures of review, the paper's matching table, how far a review is."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Response

from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.evaluation import matching_schemas, review_schemas, selection
from app.evaluation.agreement_figures import agreement_figures
from app.evaluation.breakdown import By, Viewer
from app.evaluation.matching import matching_figures
from app.evaluation.matching_schemas import MatchingOut
from app.evaluation.review_figures import review_figures
from app.evaluation.review_progress import review_progress
from app.evaluation.review_schemas import GroupOut, ReviewFiguresOut, ReviewProgressOut
from app.evaluation.schemas import sample_of
from app.evaluation.selection import Asked, Selection
from app.evaluation.tables import TableFormat, csv_response

router = APIRouter(tags=["evaluation"], prefix="/evaluation")

Reader = Annotated[Access, allowed(Scope.READ)]
AskedDep = Annotated[Asked, Depends(selection.asked_for)]
HalfWidth = Annotated[
    float,
    Query(gt=0, lt=0.5, description="Wanted half of the 95 % interval's width, fraction of one"),
]
BinWidth = Annotated[int, Query(ge=10, le=5000, description="Width of the bins of range, m")]
GROUP_COLUMNS = (
    "by",
    "group",
    "poses",
    "graded",
    "good",
    "ok",
    "bad",
    "wrong",
    "share_good",
    "share_good_low",
    "share_good_high",
    "share_acceptable",
    "share_acceptable_low",
    "share_acceptable_high",
)


def viewer_of(access: Access, chosen: Selection) -> Viewer:
    """Tell who looks; who runs the site (operators) may see each reviewer by name."""
    return Viewer(access.user_id, access.may(Scope.INGEST, chosen.site_id))


def csv_or_json(description: str) -> dict[int | str, dict[str, object]]:
    """Describe an answer that comes as JSON or as CSV."""
    return {200: {"description": description, "content": {"text/csv": {}}}}


@router.get(
    "/reviews",
    response_model=ReviewFiguresOut,
    responses=csv_or_json("The figures; as CSV the groups, after a line for the whole"),
)
def evaluate_reviews(
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    by: By | None = None,
    bin_m: BinWidth = 200,
    half_width: HalfWidth = 0.03,
    output: Annotated[TableFormat, Query(alias="format")] = TableFormat.JSON,
) -> ReviewFiguresOut | Response:
    """Count verdicts by grade and reason, with shares, intervals and agreement of reviewers.

    `by` splits the poses; `by=reviewer` names people only to operators of the site.
    """
    chosen = selection.select(session, access, asked)
    viewer = viewer_of(access, chosen)
    figures = review_figures(session, chosen, viewer, by=by, bin_m=bin_m, half_width=half_width)
    agreement = agreement_figures(session, chosen, viewer)
    answer = review_schemas.figures_out(figures, agreement, sample_of(chosen))
    if output is TableFormat.JSON:
        return answer
    whole = GroupOut(
        **answer.model_dump(include=set(GroupOut.model_fields)), key="all", label="all"
    )
    lines = [_group_line("all", whole)]
    lines += [_group_line(by.value if by else "", group) for group in answer.groups]
    return csv_response("quaymark-reviews", GROUP_COLUMNS, lines)


def _group_line(by: str, group: GroupOut) -> dict[str, object]:
    return {
        "by": by,
        "group": group.label,
        "poses": group.poses,
        "graded": group.graded,
        **{grade.value: count for grade, count in group.grades.items()},
        "share_good": group.good.share,
        "share_good_low": group.good.interval[0],
        "share_good_high": group.good.interval[1],
        "share_acceptable": group.acceptable.share,
        "share_acceptable_low": group.acceptable.interval[0],
        "share_acceptable_high": group.acceptable.interval[1],
    }


@router.get(
    "/matching",
    response_model=MatchingOut,
    responses=csv_or_json("The table; as CSV a line a row, closed by the denominators"),
)
def evaluate_matching(
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    output: Annotated[TableFormat, Query(alias="format")] = TableFormat.JSON,
) -> MatchingOut | Response:
    """Return the paper's matching table from the images marked complete, the paper's beside it."""
    chosen = selection.select(session, access, asked)
    answer = matching_schemas.matching_out(matching_figures(session, chosen), sample_of(chosen))
    if output is TableFormat.JSON:
        return answer
    return csv_response(
        "quaymark-matching", matching_schemas.CSV_COLUMNS, matching_schemas.csv_rows(answer)
    )


@router.get("/review-progress")
def follow_review(session: SessionDep, access: Reader, asked: AskedDep) -> ReviewProgressOut:
    """Tell how far the review of a selection is, how fast it goes, and one's own part in it."""
    chosen = selection.select(session, access, asked)
    return review_schemas.progress_out(review_progress(session, chosen, access.user_id))
