"""The page of two runs side by side, each changed pose one click from the review screen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.dependencies import SessionDep
from app.domain.pose_changes import Change
from app.errors import Invalid
from app.evaluation import selection
from app.evaluation.comparison import compare
from app.evaluation.comparison_router import (
    Least,
    LeastDep,
    Sort,
    changed_pairs,
    part_of,
    shown,
    two_runs,
)
from app.evaluation.comparison_schemas import ChangedPoseOut, ComparisonOut
from app.evaluation.pages import show_in_frame
from app.evaluation.router import AskedDep, Reader
from app.evaluation.selection import Asked
from app.paging import Paging, decode_cursor
from app.runs import service as runs
from app.tables.runs import Run

router = APIRouter()

CHANGE_NAMES = {
    Change.NEW: "New",
    Change.GONE: "Gone",
    Change.OTHER_VESSEL: "Other vessel",
    Change.MOVED: "Moved",
    Change.TURNED: "Turned",
}
AT_ONCE = 50
RunChoice = Annotated[selection.Id, Query()]
KindChoice = Annotated[Change | None, selection.FILLED, Query()]


@dataclass(frozen=True, slots=True)
class Changes:
    """A page of changed poses with the ways through the list."""

    items: Sequence[ChangedPoseOut]
    total: int
    start: int
    next_query: str
    first_query: str
    sort: str
    sort_queries: Mapping[str, str]
    kind_queries: Sequence[tuple[str, int, str, bool]]


@dataclass(frozen=True, slots=True)
class View:
    """Two runs side by side as the page shows them."""

    run: Run
    other: Run
    table: ComparisonOut
    groups: Sequence[str]
    changes: Changes
    rest: str
    changes_csv: str


@router.get("/evaluation/runs")
def show_comparison(
    request: Request,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    least: LeastDep,
    other_run_id: RunChoice = None,
    kind: KindChoice = None,
    sort: Sort = Sort.TIME,
    cursor: Annotated[str, Query(max_length=64)] = "",
) -> Response:
    """Show two runs side by side; without a second one, the form that asks for it."""
    chosen = selection.select(session, access, _only_run(asked))
    pair, why_not = _pair(session, access, asked.run_id, other_run_id)
    view = None
    if pair is not None:
        start = decode_cursor(cursor) if cursor else 0
        view = _view(session, pair, least, _Ways(_query(pair, least), kind, sort), start)
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/runs.html",
        view=view,
        why_not=why_not,
        other_run_id=other_run_id or "",
        least=least,
        kind=kind.value if kind else "",
        names={change.value: name for change, name in CHANGE_NAMES.items()},
        opens={one.id: access.may(Scope.REVIEW, one.site_id) for one in pair or ()},
        run_choices=_choices(session, access, pair),
    )


def _view(session: Session, pair: tuple[Run, Run], least: Least, ways: "_Ways", start: int) -> View:
    """Compare two runs; of the poses that changed a page from a number on."""
    run, other = pair
    comparison = compare(session, run, other)
    table = shown(session, comparison, run, other, least)
    pairs = changed_pairs(comparison, least, ways.kind, ways.sort)
    part = part_of(session, pairs, Paging(limit=AT_ONCE, after=start), pair, least)
    return View(
        run=run,
        other=other,
        table=table,
        groups=list(dict.fromkeys(figure.group for figure in table.figures)),
        changes=Changes(
            items=part.items,
            total=len(pairs),
            start=start,
            next_query=ways.to(cursor=part.next_cursor) if part.next_cursor else "",
            first_query=ways.to() if start else "",
            sort=ways.sort.value,
            sort_queries={one.value: ways.to(sort=one.value) for one in Sort},
            kind_queries=_kinds(table, ways),
        ),
        rest=f"/api/v1/evaluation/runs?{urlencode(ways.query)}",
        changes_csv=f"/api/v1/evaluation/runs/changes{ways.to(format='csv')}",
    )


def _only_run(asked: Asked) -> Asked:
    """Leave the filters of other tables alone: both runs are compared as a whole."""
    return Asked(asked.run_id, None, None, None, None, None, None)


def _pair(
    session: Session, access: Access, run_id: int | None, other_run_id: int | None
) -> tuple[tuple[Run, Run] | None, str]:
    """Return the two runs, else why there are none."""
    if run_id is None:
        return None, ""
    try:
        return two_runs(session, access, run_id, other_run_id), ""
    except Invalid as error:
        told = "; ".join(field.message for field in error.fields) or error.detail
        return None, f"{told[:1].upper()}{told[1:]}."  # whoever sees the page knows no field's name


def _choices(
    session: Session, access: Access, pair: tuple[Run, Run] | None
) -> list[tuple[object, str]]:
    """Return the newest runs, and the two that are shown, however old."""
    newest = runs.newest_runs(session, access.site_ids(Scope.READ))
    found = {
        run.id: f"{runs.label(run)} ({done.poses} poses){', reference' * done.is_reference}"
        for run, done in newest
    }
    for run in pair or ():
        found.setdefault(run.id, runs.label(run))
    return list(found.items())


def _query(pair: tuple[Run, Run], least: Least) -> dict[str, object]:
    return {
        "run_id": pair[0].id,
        "other_run_id": pair[1].id,
        "moved_m": f"{least.moved_m:g}",
        "turned_deg": f"{least.turned_deg:g}",
    }


@dataclass(frozen=True, slots=True)
class _Ways:
    """Addresses of the same page with something else chosen."""

    query: Mapping[str, object]
    kind: Change | None
    sort: Sort

    def to(self, **more: object) -> str:
        """Return the query with some fields changed; None takes one out."""
        now = {"kind": self.kind.value if self.kind else None, "sort": self.sort.value}
        fields = {**self.query, **now, **more}
        return f"?{urlencode({name: value for name, value in fields.items() if value is not None})}"


def _kinds(table: ComparisonOut, ways: _Ways) -> list[tuple[str, int, str, bool]]:
    """Return (name, count, query, whether it is shown) of all kinds of change."""
    return [
        ("All", table.changed, ways.to(kind=None), ways.kind is None),
        *(
            (name, table.changes[change.value], ways.to(kind=change.value), ways.kind is change)
            for change, name in CHANGE_NAMES.items()
        ),
    ]
