"""SQL of the verdict that counts, and where the reviewing of a pose stands.

`standing` is how the pages count. Both sides of an export ask here: which poses are selected by
their grade, and which review is written beside a pose.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.exports.driver_rows import driver_rows
from app.exports.id_lists import among
from app.tables.reviews import Review

_reviews = Review.__table__.c
_STANDS = _reviews.replaced_at.is_(None)
_ORDERS: Mapping[str, tuple[sa.ColumnElement[Any], ...]] = {
    "standing": (_reviews.second_opinion.asc(), _reviews.id.desc()),
    "newest": (_reviews.id.desc(),),
    "consensus": (_reviews.settles.desc(), _reviews.id.desc()),
}


def counted_grade(pose_id: sa.ColumnElement[int], verdict: str) -> sa.ScalarSelect[Any]:
    """Return the grade that counts for a pose in a query."""
    return (
        sa.select(_reviews.grade)
        .where(_reviews.pose_id == pose_id, *_counts(verdict))
        .order_by(*_ORDERS[verdict])
        .limit(1)
        .scalar_subquery()
    )


def _counts(verdict: str) -> list[sa.ColumnElement[bool]]:
    if verdict != "consensus":
        return [_STANDS]
    other = Review.__table__.alias()
    differs = sa.exists().where(
        other.c.pose_id == _reviews.pose_id,
        other.c.replaced_at.is_(None),
        other.c.grade != _reviews.grade,
    )
    return [_STANDS, sa.or_(_reviews.settles, ~differs)]


def counted_reviews(session: Session, pose_ids: Sequence[int], verdict: str) -> Sequence[Any]:
    """Return rows of some poses' reviews (see `review_records`): of each the first counts."""
    return driver_rows(
        session,
        sa.select(
            _reviews.pose_id,
            sa.cast(_reviews.grade, sa.Text),
            sa.cast(_reviews.reasons, sa.Text),
            _reviews.guideline_version,
            _reviews.created_at,
        )
        .where(among(_reviews.pose_id, pose_ids), *_counts(verdict))
        .order_by(*_ORDERS[verdict]),
    )


def pose_state(pose_id: sa.ColumnElement[int], state: str) -> sa.ColumnElement[bool]:
    """Whether the reviewing of a pose in a query stands at a state, as the lists have it."""
    other = Review.__table__.alias()
    differ = sa.exists().where(
        other.c.pose_id == _reviews.pose_id,
        other.c.replaced_at.is_(None),
        other.c.grade != _reviews.grade,
    )
    settled = standing_review(pose_id, _reviews.settles)
    return {
        "ungraded": ~standing_review(pose_id),
        "graded": standing_review(pose_id),
        "second_opinion": standing_review(pose_id, _reviews.second_opinion),
        "disagreement": standing_review(pose_id, differ) & ~settled,
        "settled": settled,
    }[state]


def standing_review(
    pose_id: sa.ColumnElement[int], *conditions: sa.ColumnElement[bool]
) -> sa.Exists:
    """Whether a pose in a query has a standing review of which some conditions hold."""
    return sa.exists().where(_reviews.pose_id == pose_id, _STANDS, *conditions)
