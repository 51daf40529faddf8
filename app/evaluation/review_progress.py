"""How far a review is: poses graded, images complete, at what rate, and one's own part in it.

There is no league table: a person sees their own count and everybody's together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.db import now
from app.evaluation import review_repository as repository
from app.evaluation.selection import Selection

WINDOW = timedelta(hours=1)
STEP = timedelta(minutes=5)
RECENT = timedelta(minutes=10)


@dataclass(frozen=True, slots=True)
class Step:
    """The grades of five minutes: all of them, and one's own."""

    start: datetime
    grades: int
    own: int


@dataclass(frozen=True, slots=True)
class ReviewProgress:
    """How far a selection is reviewed; the rate is that of the last ten minutes.

    `remaining_s` is what is left at that rate; None while nobody grades.
    """

    poses: int
    graded: int
    images: int
    complete_images: int
    own_graded: int
    grades_per_min: float
    own_grades_per_min: float
    remaining_s: float | None
    last_graded_at: datetime | None
    last_hour: Sequence[Step]


def review_progress(session: Session, selection: Selection, user_id: int) -> ReviewProgress:
    """Tell how far a selection's review is, and what this person did of it."""
    at = now()
    times = repository.grading_times(session, selection, at - WINDOW)
    recent = [person for moment, person in times if moment >= at - RECENT]
    rate_per_min = len(recent) / (RECENT / timedelta(minutes=1))
    poses = repository.pose_count(session, selection)
    graded = repository.graded_poses(session, selection)
    return ReviewProgress(
        poses=poses,
        graded=graded,
        images=repository.images(session, selection),
        complete_images=sum(repository.complete_images(session, selection).values()),
        own_graded=repository.grades_by_person(session, selection, user_id),
        grades_per_min=rate_per_min,
        own_grades_per_min=recent.count(user_id) / (RECENT / timedelta(minutes=1)),
        remaining_s=60 * (poses - graded) / rate_per_min if rate_per_min else None,
        last_graded_at=times[-1][0] if times else None,
        last_hour=_steps(times, at, user_id),
    )


def _steps(times: Sequence[tuple[datetime, int | None]], at: datetime, user_id: int) -> list[Step]:
    count = WINDOW // STEP
    everybody, own = [0] * count, [0] * count
    for moment, person in times:
        index = min(count - 1, max(0, (moment - (at - WINDOW)) // STEP))
        everybody[index] += 1
        own[index] += person == user_id
    return [
        Step(at - WINDOW + index * STEP, everybody[index], own[index]) for index in range(count)
    ]
