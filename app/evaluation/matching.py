"""The matching table from what reviewers said of the images they marked complete.

Only complete images count, because only there every visible vessel is accounted for; a pose in them
that nobody has graded yet is left out and told. A pose counts with the verdict that stands for it,
a wrong one in the row of the first reason given. Vessels without a pose are those that a person
marked as missed.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.matching_table import (
    LABELS,
    NOT_GIVEN,
    MatchingTable,
    Result,
    RowName,
    matching_table,
)
from app.errors import Invalid
from app.evaluation import review_repository as repository
from app.evaluation.review_repository import Verdict
from app.evaluation.selection import Selection
from app.tables.queues import QueueUnit
from app.tables.reviews import Grade


@dataclass(frozen=True, slots=True)
class MatchingFigures:
    """The table, with what it rests on: complete images, by run, of how many there are."""

    table: MatchingTable
    complete_images: Mapping[int, int]
    images: int
    ungraded: int

    @property
    def complete(self) -> int:
        """How many images were marked complete."""
        return sum(self.complete_images.values())


def matching_figures(session: Session, selection: Selection) -> MatchingFigures:
    """Fill the paper's matching table from a selection's complete images.

    Raises Invalid for a queue of poses: a sample of poses has no denominator of vessels.
    """
    queue = selection.queue
    if queue is not None and queue.unit is not QueueUnit.IMAGE:
        raise Invalid.field(
            "queue_id",
            "is a queue of poses; the table counts visible vessels, so it needs one of images",
        )
    standing = {
        verdict.pose_id: verdict
        for verdict in repository.verdicts(session, selection, complete=True)
    }
    counts = Counter(row_of(verdict) for verdict in standing.values())
    for reason, count in repository.missed(session, selection).items():
        counts[RowName(Result.NO_MATCH, reason.value)] += count
    return MatchingFigures(
        table=matching_table(counts),
        complete_images=repository.complete_images(session, selection),
        images=repository.images(session, selection),
        ungraded=repository.poses_in_complete_images(session, selection) - len(standing),
    )


def row_of(verdict: Verdict) -> RowName:
    """Return the one row a verdict counts in."""
    if verdict.grade is not Grade.WRONG:
        return RowName(Result.CORRECT, verdict.grade.value)
    reason = verdict.reasons[0] if verdict.reasons else NOT_GIVEN
    name = RowName(Result.WRONG, reason)
    return name if name in LABELS else RowName(Result.WRONG, "other")
