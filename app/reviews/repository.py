"""SQL of poses and the verdicts on them."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session, contains_eager, joinedload

from app.db import find
from app.ids import LARGEST_WIDE_ID
from app.paging import Paging, fetch_page
from app.tables.ais import Vessel
from app.tables.imagery import Image
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose, Run

UNGRADED = "ungraded"
_CURRENT = Review.replaced_at.is_(None)


def pose(session: Session, pose_id: int) -> Pose | None:
    """Return a pose with its image, run, match, detection and vessel state."""
    return find(session, Pose, pose_id, joinedload(Pose.image), joinedload(Pose.run))


def site_of_pose(session: Session, pose_id: int) -> int | None:
    """Return the site a pose belongs to; None for the poses of a deleted image."""
    if not 0 < pose_id <= LARGEST_WIDE_ID:
        return None
    return session.scalar(
        sa.select(Run.site_id)
        .join(Pose, Pose.run_id == Run.id)
        .join(Image, Image.id == Pose.image_id)
        .where(Pose.id == pose_id, Image.deleted_at.is_(None))
    )


def poses(
    session: Session,
    site_ids: Iterable[int] | None,
    paging: Paging,
    *,
    run_id: int | None = None,
    image_id: int | None = None,
    mmsi: int | None = None,
    grade: str | None = None,
) -> tuple[Sequence[Pose], str | None]:
    """Return a page of poses of some sites (None: all), in the order they were made in.

    So the poses of one image stand together within a run. Those of deleted images are left out.
    """
    statement = (
        sa.select(Pose)
        .join(Pose.image)
        .options(contains_eager(Pose.image))
        .where(Image.deleted_at.is_(None))
    )
    if site_ids is not None:
        statement = statement.join(Run, Run.id == Pose.run_id).where(Run.site_id.in_(site_ids))
    if run_id is not None:
        statement = statement.where(Pose.run_id == run_id)
    if image_id is not None:
        statement = statement.where(Pose.image_id == image_id)
    if mmsi is not None:
        statement = statement.where(Pose.mmsi == mmsi)
    if grade == UNGRADED:
        statement = statement.where(newest_grade().is_(None))
    elif grade is not None:
        statement = statement.where(newest_grade() == Grade(grade))
    return fetch_page(session, statement, Pose.id, paging)


def newest_grade() -> sa.ScalarSelect[Grade]:
    """Return the grade that stands for a pose in a query: that of its newest standing review."""
    return (
        sa.select(Review.grade)
        .where(Review.pose_id == Pose.id, _CURRENT)
        .order_by(Review.id.desc())
        .limit(1)
        .correlate(Pose)
        .scalar_subquery()
    )


def current_reviews(session: Session, pose_ids: Sequence[int]) -> Mapping[int, Review]:
    """Return the newest standing review of each pose that has one."""
    rows = session.scalars(
        sa.select(Review).where(Review.pose_id.in_(pose_ids), _CURRENT).order_by(Review.id)
    )
    return {review.pose_id: review for review in rows}


def reviews_of(session: Session, pose_id: int) -> Sequence[Review]:
    """Return all reviews of a pose, replaced ones too, oldest first."""
    return session.scalars(
        sa.select(Review).where(Review.pose_id == pose_id).order_by(Review.id)
    ).all()


def vessels(session: Session, mmsis: Iterable[int]) -> Mapping[int, Vessel]:
    """Return what is known of some vessels."""
    rows = session.scalars(sa.select(Vessel).where(Vessel.mmsi.in_(set(mmsis))))
    return {vessel.mmsi: vessel for vessel in rows}


def replace_review(session: Session, review: Review, at: datetime) -> None:
    """Store a person's review of a pose in the place of their earlier one, which is kept."""
    # One at a time for each pose: a double click must not find the same earlier review twice.
    session.execute(
        sa.select(Pose.id).where(Pose.id == review.pose_id).with_for_update(key_share=True)
    )
    session.execute(
        sa.update(Review)
        .where(Review.pose_id == review.pose_id, Review.user_id == review.user_id, _CURRENT)
        .values(replaced_at=at)
    )
    session.add(review)
    session.flush()


def grade_counts(
    session: Session, run_ids: Collection[int]
) -> Mapping[int, tuple[int, Mapping[Grade, int]]]:
    """Return, for each run, how many poses it has and how many of them stand at each grade.

    The poses of deleted images do not count.
    """
    grade = newest_grade().label("grade")
    graded = (
        sa.select(Pose.run_id, grade)
        .join(Image, Image.id == Pose.image_id)
        .where(Pose.run_id.in_(run_ids), Image.deleted_at.is_(None))
        .subquery()
    )
    rows = session.execute(
        sa.select(graded.c.run_id, graded.c.grade, sa.func.count()).group_by(
            graded.c.run_id, graded.c.grade
        )
    )
    totals = dict.fromkeys(run_ids, 0)
    by_grade: dict[int, dict[Grade, int]] = {run_id: {} for run_id in run_ids}
    for run_id, standing, count in rows:
        totals[run_id] += count
        if standing is not None:
            by_grade[run_id][standing] = count
    return {run_id: (totals[run_id], by_grade[run_id]) for run_id in run_ids}
