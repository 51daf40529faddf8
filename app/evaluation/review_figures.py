"""Figures of review: how many poses are Good, how sure that is, and where they are not.

A pose counts once, with the verdict that stands for it: the first opinion, or the one that settled
a disagreement. Second opinions tell how far reviewers agree and are counted nowhere else. Verdicts
inherited from an earlier run count, and how many they are is said.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.sampling import Share, needed_total
from app.evaluation import review_repository as repository
from app.evaluation.breakdown import By, Viewer, breakdown
from app.evaluation.review_repository import Verdict
from app.evaluation.selection import Selection
from app.evaluation.tally import Tally, tally

WORST_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class Wanted:
    """How many poses a wanted half-width of an interval needs, and how many more that is.

    `of_many` is for poses like these without end; `of_these` for no more than the poses here.
    """

    share: float
    of_many: int
    more_of_many: int
    of_these: int
    more_of_these: int


@dataclass(frozen=True, slots=True)
class Group:
    """A part of the poses with its figures."""

    key: str
    label: str
    poses: int | None
    tally: Tally


@dataclass(frozen=True, slots=True)
class ReviewFigures:
    """How a selection of poses was judged."""

    poses: int
    tally: Tally
    inherited: int
    second_opinions: int
    guideline_versions: Mapping[int, int]
    half_width: float
    wanted_good: Wanted
    wanted_acceptable: Wanted
    by: By | None
    groups: Sequence[Group]


def review_figures(
    session: Session,
    selection: Selection,
    viewer: Viewer,
    *,
    by: By | None = None,
    bin_m: int = 200,
    half_width: float = 0.03,
) -> ReviewFigures:
    """Sum up the verdicts on a selection's poses, as a whole and by one of their properties."""
    verdicts = repository.verdicts(session, selection)
    standing = {verdict.pose_id: verdict for verdict in verdicts}
    whole = tally(standing.values())
    if by is None:
        poses, groups = repository.pose_count(session, selection), []
    else:
        rows = repository.poses(session, selection)
        poses = len(rows)
        groups = [
            Group(part.key, part.label, part.poses, tally(part.verdicts))
            for part in breakdown(session, by, rows, verdicts, standing, viewer, bin_m=bin_m)
        ]
    return ReviewFigures(
        poses=poses,
        tally=whole,
        inherited=sum(v.inherited_from_id is not None for v in standing.values()),
        second_opinions=len(verdicts) - len(standing),
        guideline_versions=_versions(standing),
        half_width=half_width,
        wanted_good=_wanted(whole.good, half_width, poses),
        wanted_acceptable=_wanted(whole.acceptable, half_width, poses),
        by=by,
        groups=groups,
    )


def _versions(standing: Mapping[int, Verdict]) -> Mapping[int, int]:
    return dict(sorted(Counter(v.guideline_version for v in standing.values()).items()))


def _wanted(share: Share, half_width: float, population: int) -> Wanted:
    expected = WORST_SHARE if share.value is None else share.value
    many = needed_total(expected, half_width)
    these = needed_total(expected, half_width, population)
    return Wanted(
        share=expected,
        of_many=many,
        more_of_many=max(0, many - share.total),
        of_these=these,
        more_of_these=max(0, these - share.total),
    )
