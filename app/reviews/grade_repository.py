"""SQL of grading: one pose at a time is locked, so that who came first is never in doubt."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import Base
from app.tables.reviews import Review
from app.tables.runs import Pose

_STANDING = Review.replaced_at.is_(None)
# Asked at every grade, so they are put together once.
_STANDING_OF = sa.select(Review.id, Review.user_id, Review.second_opinion, Review.settles).where(
    Review.pose_id == sa.bindparam("pose_id"), _STANDING
)
_ADD = sa.insert(Base.metadata.tables["reviews"]).returning(Review.id)


@dataclass(frozen=True, slots=True)
class Standing:
    """What is needed of a standing review to place another beside it."""

    id: int
    user_id: int | None
    second_opinion: bool
    settles: bool


def lock(session: Session, pose_ids: Iterable[int]) -> None:
    """Let nobody else review these poses until the transaction ends.

    In the order of their ids, so that two who want the same never wait for each other. On SQLite
    the writing transaction holds everything already.
    """
    if session.get_bind().dialect.name != "sqlite":
        session.execute(
            sa.select(Pose.id)
            .where(Pose.id.in_(list(pose_ids)))
            .order_by(Pose.id)
            .with_for_update(key_share=True)
        )


def standing(session: Session, pose_id: int) -> Sequence[Standing]:
    """Return the standing reviews of a pose."""
    rows = session.execute(_STANDING_OF, {"pose_id": pose_id})
    return [Standing(*row) for row in rows]


def replace(session: Session, review_id: int, at: datetime) -> None:
    """Let a review stand no longer."""
    session.execute(sa.update(Review).where(Review.id == review_id).values(replaced_at=at))


def demote(session: Session, review_ids: Collection[int]) -> None:
    """Make reviews second opinions."""
    session.execute(sa.update(Review).where(Review.id.in_(review_ids)).values(second_opinion=True))


def add(session: Session, columns: dict[str, Any]) -> Review:
    """Store a review; without loading what the caller knows already."""
    identifier = session.execute(_ADD, columns).scalar_one()
    return Review(id=identifier, **columns)


def of_decision(session: Session, user_id: int, decision: str) -> Sequence[Review]:
    """Return a person's reviews of one decision, by pose."""
    return session.scalars(
        sa.select(Review)
        .where(Review.user_id == user_id, Review.decision == decision)
        .order_by(Review.pose_id, Review.id)
    ).all()


def set_words(
    session: Session, review_ids: Collection[int], at: datetime, **columns: object
) -> None:
    """Change the reasons or the comment of reviews."""
    session.execute(
        sa.update(Review).where(Review.id.in_(review_ids)).values(words_at=at, **columns)
    )


def withdraw(session: Session, review: Review, at: datetime) -> None:
    """Take a review back; the person's one before it stands again if this one stood."""
    stood = review.replaced_at is None
    session.execute(
        sa.update(Review)
        .where(Review.id == review.id)
        .values(withdrawn_at=at, replaced_at=sa.func.coalesce(Review.replaced_at, at))
    )
    if stood:
        _let_the_one_before_stand(session, review)
        _let_somebody_come_first(session, review.pose_id)


def _let_the_one_before_stand(session: Session, review: Review) -> None:
    before = (
        sa.select(sa.func.max(Review.id))
        .where(
            Review.pose_id == review.pose_id,
            Review.user_id == review.user_id,
            Review.id < review.id,
            Review.withdrawn_at.is_(None),
        )
        .scalar_subquery()
    )
    session.execute(sa.update(Review).where(Review.id == before).values(replaced_at=None))


def _let_somebody_come_first(session: Session, pose_id: int) -> None:
    """Make the oldest of a pose's second opinions its verdict where no verdict is left."""
    found = standing(session, pose_id)
    if found and all(review.second_opinion for review in found):
        first = min(review.id for review in found)
        session.execute(sa.update(Review).where(Review.id == first).values(second_opinion=False))


def poses_of_image(session: Session, run_id: int, image_id: int) -> Sequence[int]:
    """Return the ids of the poses of an image in a run, in order."""
    return session.scalars(
        sa.select(Pose.id).where(Pose.run_id == run_id, Pose.image_id == image_id).order_by(Pose.id)
    ).all()


def graded(session: Session, pose_ids: Collection[int], by: int | None = None) -> Collection[int]:
    """Return which poses have a standing review, of a person where one is named."""
    statement = sa.select(Review.pose_id).where(Review.pose_id.in_(pose_ids), _STANDING)
    if by is not None:
        statement = statement.where(Review.user_id == by)
    return set(session.scalars(statement))
