"""REST of two runs side by side, and of the poses that changed between them."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.dependencies import Page, PagingDep, SessionDep
from app.domain.pose_changes import Change, PosePair
from app.errors import Invalid
from app.evaluation import comparison_repository as repository
from app.evaluation.answers import tagged
from app.evaluation.comparison import Comparison, compare
from app.evaluation.comparison_schemas import (
    CHANGE_COLUMNS,
    FIGURE_COLUMNS,
    ChangedPoseOut,
    ComparisonOut,
    change_rows,
    changed_out,
    comparison_out,
    figure_rows,
)
from app.evaluation.router import Reader, csv_or_json
from app.evaluation.tables import TableFormat
from app.identities import service as identities
from app.ids import RowId
from app.paging import Paging, encode_cursor
from app.runs import actions, references
from app.tables.runs import Run

router = APIRouter(tags=["evaluation"], prefix="/evaluation")

MOVED_M, TURNED_DEG = 5.0, 5.0
Output = Annotated[TableFormat, Query(alias="format")]


class Sort(StrEnum):
    """The order of changed poses; the greatest first where it begins with a minus."""

    TIME = "time"
    MOVED = "moved_m"
    MOST_MOVED = "-moved_m"
    TURNED = "turned_deg"
    MOST_TURNED = "-turned_deg"


@dataclass(frozen=True, slots=True)
class Least:
    """From which movement on a pose counts as changed."""

    moved_m: float
    turned_deg: float

    @property
    def both(self) -> tuple[float, float]:
        """Metres and degrees."""
        return self.moved_m, self.turned_deg


def least_asked(
    moved_m: Annotated[
        float, Query(ge=0, le=100_000, description="A pose moved if by more than this, m")
    ] = MOVED_M,
    turned_deg: Annotated[
        float, Query(ge=0, le=180, description="A pose turned if by more than this, degrees")
    ] = TURNED_DEG,
) -> Least:
    """Read from which movement on a pose counts as changed."""
    return Least(moved_m, turned_deg)


LeastDep = Annotated[Least, Depends(least_asked)]
OtherRun = Annotated[
    RowId | None, Query(description="The run to compare with; else its site's reference run")
]


def two_runs(
    session: Session, access: Access, run_id: int, other_run_id: int | None
) -> tuple[Run, Run]:
    """Return a run and the one to compare it with.

    Raises NotFound for runs one may not read, Invalid where there is no other run.
    """
    run = actions.run_for(session, access, Scope.READ, run_id)
    if other_run_id is not None:
        other = actions.run_for(session, access, Scope.READ, other_run_id)
        if other.id == run.id:
            raise Invalid.field("other_run_id", "is the same run: name another one")
        return run, other
    reference = references.reference_of(session, run.site_id)
    if reference is None:
        raise Invalid.field(
            "other_run_id", "name a run: its site has no reference run to compare with"
        )
    if reference.id == run.id:
        raise Invalid.field("other_run_id", "name a run: this one is its site's reference itself")
    return run, reference


def shown(
    session: Session, comparison: Comparison, run: Run, other: Run, least: Least
) -> ComparisonOut:
    """Write a comparison out."""
    found = (references.reference_of(session, one.site_id) for one in (run, other))
    ids = frozenset(one.id for one in found if one is not None)
    return comparison_out(comparison, (run, other), ids, least.both)


@router.get(
    "/runs",
    response_model=ComparisonOut,
    responses=csv_or_json("The comparison; as CSV a line for each parameter, count and figure"),
)
def compare_runs(
    request: Request,
    session: SessionDep,
    access: Reader,
    least: LeastDep,
    run_id: RowId,
    other_run_id: OtherRun = None,
    output: Output = TableFormat.JSON,
) -> Response:
    """Compare a run with another one, or with its site's reference, on the images both have.

    What was set differently, counts, and figures with the interval of their difference: the same
    images drawn anew for both. `/evaluation/runs/changes` lists the poses that changed.
    """
    run, other = two_runs(session, access, run_id, other_run_id)
    answer = shown(session, compare(session, run, other), run, other, least)
    return tagged(request, output, answer, "runs", FIGURE_COLUMNS, figure_rows(answer))


@router.get(
    "/runs/changes",
    response_model=Page[ChangedPoseOut],
    responses=csv_or_json("Changed poses; as CSV a line for each, all of them where no limit is"),
)
def list_changes(
    request: Request,
    session: SessionDep,
    access: Reader,
    least: LeastDep,
    paging: PagingDep,
    run_id: RowId,
    other_run_id: OtherRun = None,
    kind: Change | None = None,
    sort: Sort = Sort.TIME,
    output: Output = TableFormat.JSON,
) -> Response:
    """List the poses that changed between two runs: new, gone, of another vessel, moved, turned."""
    run, other = two_runs(session, access, run_id, other_run_id)
    pairs = changed_pairs(compare(session, run, other), least, kind, sort)
    if output is TableFormat.CSV and "limit" not in request.query_params:
        paging = Paging(limit=max(1, len(pairs)), after=paging.after)
    part = part_of(session, pairs, paging, (run, other), least)
    return tagged(request, output, part, "changed-poses", CHANGE_COLUMNS, change_rows(part.items))


def changed_pairs(
    comparison: Comparison, least: Least, kind: Change | None, sort: Sort
) -> list[PosePair]:
    """Return the poses that changed, of one kind where asked; without movement last."""
    found = []
    for pair in comparison.pairs:
        changes = pair.changes(*least.both)
        if changes and kind in {None, *changes}:
            found.append(pair)
    if sort is Sort.TIME:
        return found
    descending = sort.value.startswith("-")
    name = sort.value.removeprefix("-")
    known = [pair for pair in found if getattr(pair, name) is not None]
    known.sort(key=lambda pair: getattr(pair, name), reverse=descending)
    return known + [pair for pair in found if getattr(pair, name) is None]


def part_of(
    session: Session,
    pairs: list[PosePair],
    paging: Paging,
    sides: tuple[Run, Run],
    least: Least,
) -> Page[ChangedPoseOut]:
    """Return a page of changed poses; its cursor says how many came before."""
    start = paging.after or 0
    end = start + paging.limit
    wanted = pairs[start:end]
    images = repository.image_names(session, {pair.image_id for pair in wanted})
    told = tuple(identities.at_site(session, one.site_id) for one in sides)
    return Page(
        items=[
            changed_out(pair, least.both, images.get(pair.image_id, ("", None)), (told[0], told[1]))
            for pair in wanted
        ],
        next_cursor=encode_cursor(end) if end < len(pairs) else None,
    )
