"""Reviews: a person's verdict on a generated pose.

A verdict never changes: grading again puts a new one in the place of the person's last, and the
old one stays readable. Another person's verdict stands beside it as a second opinion.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.db import now
from app.domain.grading import GUIDELINE_VERSION, check_reasons
from app.domain.sampling import wilson_interval
from app.errors import Invalid, NotFound
from app.paging import Paging
from app.reviews import repository
from app.tables.ais import Vessel
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose


@dataclass(frozen=True, slots=True)
class ReviewedPose:
    """A pose, the vessel it is of, and the newest standing verdict on it."""

    pose: Pose
    vessel: Vessel | None
    review: Review | None


@dataclass(frozen=True, slots=True)
class Verdicts:
    """How a run's poses were judged, with 95 % intervals of the shares."""

    poses: int
    counts: Mapping[Grade, int]
    graded: int
    good: float | None
    good_interval: tuple[float, float]
    acceptable: float | None
    acceptable_interval: tuple[float, float]


def site_of_pose(session: Session, pose_id: int) -> int:
    """Return the site a pose belongs to. Raises NotFound."""
    site_id = repository.site_of_pose(session, pose_id)
    if site_id is None:
        raise NotFound("there is no such pose")
    return site_id


def get_pose(session: Session, pose_id: int) -> ReviewedPose:
    """Return a pose with its vessel and verdict. Raises NotFound."""
    pose = repository.pose(session, pose_id)
    if pose is None:
        raise NotFound("there is no such pose")
    return _with_verdicts(session, [pose])[0]


def list_poses(
    session: Session,
    site_ids: frozenset[int] | None,
    paging: Paging,
    *,
    run_id: int | None = None,
    image_id: int | None = None,
    mmsi: int | None = None,
    grade: str | None = None,
) -> tuple[list[ReviewedPose], str | None]:
    """Return a page of poses with their vessels and verdicts."""
    poses, cursor = repository.poses(
        session, site_ids, paging, run_id=run_id, image_id=image_id, mmsi=mmsi, grade=grade
    )
    return _with_verdicts(session, poses), cursor


def _with_verdicts(session: Session, poses: Sequence[Pose]) -> list[ReviewedPose]:
    reviews = repository.current_reviews(session, [pose.id for pose in poses])
    vessels = repository.vessels(session, (pose.mmsi for pose in poses))
    return [ReviewedPose(pose, vessels.get(pose.mmsi), reviews.get(pose.id)) for pose in poses]


def reviews_of(session: Session, pose_id: int) -> Sequence[Review]:
    """Return all verdicts on a pose, replaced ones too, oldest first."""
    return repository.reviews_of(session, pose_id)


def grade_pose(
    session: Session,
    pose_id: int,
    user_id: int,
    *,
    grade: Grade,
    reasons: Sequence[str] = (),
    comment: str | None = None,
    seconds: float | None = None,
) -> Review:
    """Store a person's verdict. Raises Invalid naming `reasons` where they do not fit the grade."""
    try:
        check_reasons(grade, reasons)
    except ValueError as error:
        raise Invalid.field("reasons", str(error)) from error
    review = Review(
        pose_id=pose_id,
        user_id=user_id,
        grade=grade,
        reasons=list(dict.fromkeys(reasons)),
        comment=comment or None,
        seconds=seconds,
        guideline_version=GUIDELINE_VERSION,
    )
    repository.replace_review(session, review, now())
    return review


def verdicts(session: Session, run_id: int) -> Verdicts:
    """Sum up how a run's poses were judged; acceptable is Good or OK (paper, evaluation)."""
    return verdicts_by_run(session, [run_id])[run_id]


def verdicts_by_run(session: Session, run_ids: Collection[int]) -> Mapping[int, Verdicts]:
    """Sum up how the poses of each of some runs were judged, in one query."""
    found = repository.grade_counts(session, run_ids)
    return {run_id: _verdicts(total, counts) for run_id, (total, counts) in found.items()}


def _verdicts(total: int, counts: Mapping[Grade, int]) -> Verdicts:
    graded = sum(counts.values())
    good = counts.get(Grade.GOOD, 0)
    acceptable = good + counts.get(Grade.OK, 0)
    return Verdicts(
        poses=total,
        counts=counts,
        graded=graded,
        good=good / graded if graded else None,
        good_interval=wilson_interval(good, graded),
        acceptable=acceptable / graded if graded else None,
        acceptable_interval=wilson_interval(acceptable, graded),
    )
