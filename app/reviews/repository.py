"""SQL of poses and the verdicts on them."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.paging import Paging, fetch_page
from app.tables.ais import Vessel
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose, Run

UNGRADED = "ungraded"
_CURRENT = Review.replaced_at.is_(None)


def pose(session: Session, pose_id: int) -> Pose | None:
    """Return a pose with its image, run, match, detection and vessel state."""
    return session.get(Pose, pose_id, options=[joinedload(Pose.image), joinedload(Pose.run)])


def site_of_pose(session: Session, pose_id: int) -> int | None:
    """Return the site a pose belongs to."""
    return session.scalar(
        sa.select(Run.site_id).join(Pose, Pose.run_id == Run.id).where(Pose.id == pose_id)
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
    """Return a page of poses of some sites (None: all)."""
    statement = sa.select(Pose).options(joinedload(Pose.image))
    if site_ids is not None:
        statement = statement.join(Run, Run.id == Pose.run_id).where(Run.site_id.in_(site_ids))
    if run_id is not None:
        statement = statement.where(Pose.run_id == run_id)
    if image_id is not None:
        statement = statement.where(Pose.image_id == image_id)
    if mmsi is not None:
        statement = statement.where(Pose.mmsi == mmsi)
    if grade == UNGRADED:
        statement = statement.where(~_graded(None))
    elif grade is not None:
        statement = statement.where(_graded(Grade(grade)))
    return fetch_page(session, statement, Pose.id, paging)


def _graded(grade: Grade | None) -> sa.ColumnElement[bool]:
    condition = sa.exists().where(Review.pose_id == Pose.id, _CURRENT)
    return condition if grade is None else condition.where(Review.grade == grade)


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
    session.execute(
        sa.update(Review)
        .where(Review.pose_id == review.pose_id, Review.user_id == review.user_id, _CURRENT)
        .values(replaced_at=at)
    )
    session.add(review)
    session.flush()


def grade_counts(session: Session, run_id: int) -> tuple[int, Mapping[Grade, int]]:
    """Return how many poses a run has, and how many of them stand at each grade."""
    total = session.scalar(
        sa.select(sa.func.count()).select_from(Pose).where(Pose.run_id == run_id)
    )
    newest = (
        sa.select(sa.func.max(Review.id))
        .join(Pose, Pose.id == Review.pose_id)
        .where(Pose.run_id == run_id, _CURRENT)
        .group_by(Review.pose_id)
    )
    rows = session.execute(
        sa.select(Review.grade, sa.func.count()).where(Review.id.in_(newest)).group_by(Review.grade)
    )
    return total or 0, {row[0]: row[1] for row in rows}
