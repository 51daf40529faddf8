"""SQL of making a review queue: the units a run has, what is known of them, and the items' rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.domain.review_order import Certainty, worst_sigma_m
from app.tables.imagery import Image
from app.tables.queues import ReviewQueueItem
from app.tables.reviews import ImageCompletion, Review, verdict_order
from app.tables.runs import Match, Pose, RunImage

ROWS_AT_ONCE = 1000


@dataclass(frozen=True, slots=True)
class Unit:
    """Something that can be put into a queue: an image, or a pose in it."""

    image_id: int
    pose_id: int | None


def images_in_time(session: Session, run_id: int) -> Sequence[Unit]:
    """Return the usable images of a run in the order of their time, with and without poses."""
    rows = session.scalars(
        sa.select(RunImage.image_id)
        .join(Image, Image.id == RunImage.image_id)
        .where(
            RunImage.run_id == run_id,
            RunImage.done_at.is_not(None),
            RunImage.error.is_(None),
            Image.deleted_at.is_(None),
        )
        .order_by(RunImage.position)
    )
    return [Unit(image_id, None) for image_id in rows]


def poses_in_time(
    session: Session, run_id: int, *conditions: sa.ColumnElement[bool]
) -> Sequence[Unit]:
    """Return the poses of a run in the order of their images' time, those that are wanted."""
    rows = session.execute(
        sa.select(Pose.image_id, Pose.id)
        .join(Image, Image.id == Pose.image_id)
        .where(Pose.run_id == run_id, Image.deleted_at.is_(None), *conditions)
        .order_by(Image.captured_at, Image.id, Pose.id)
    )
    return [Unit(row[0], row[1]) for row in rows]


class Doubtable(NamedTuple):
    """What is known of how sure a pose is; `certainty` where its estimator told."""

    image_id: int
    cost: float
    flags: Sequence[str]
    certainty: Certainty | None


def doubtable(session: Session, run_id: int) -> Mapping[int, Doubtable]:
    """Return how sure each pose of a run is."""
    rows = session.execute(
        sa.select(
            Pose.id,
            Pose.image_id,
            Match.cost,
            Match.cost_terms,
            Pose.flags,
            Pose.position_covariance_in_enu_m2,
            Pose.heading_sigma_deg,
            Pose.height_sigma_m,
        )
        .join(Match, Match.id == Pose.match_id)
        .where(Pose.run_id == run_id)
    )
    found = {}
    for pose_id, image_id, cost, terms, flags, covariance, heading_deg, height_m in rows:
        certainty = None
        if covariance is not None and heading_deg is not None and height_m is not None:
            place_m = worst_sigma_m(covariance)
            certainty = Certainty(place_m, heading_deg, height_m, terms.get("probability"))
        found[pose_id] = Doubtable(image_id, cost, flags, certainty)
    return found


def graders(session: Session, run_id: int) -> Mapping[int, Sequence[tuple[int | None, datetime]]]:
    """Return who graded each pose of a run and when, the one whose verdict counts first."""
    rows = session.execute(
        sa.select(Review.pose_id, Review.user_id, Review.created_at)
        .join(Pose, Pose.id == Review.pose_id)
        .where(Pose.run_id == run_id, Review.replaced_at.is_(None))
        .order_by(Review.pose_id, *verdict_order())
    )
    found: dict[int, list[tuple[int | None, datetime]]] = {}
    for pose_id, user_id, created_at in rows:
        found.setdefault(pose_id, []).append((user_id, created_at))
    return found


def completers(
    session: Session, run_id: int
) -> Mapping[int, Sequence[tuple[int | None, datetime]]]:
    """Return who completed each image of a run and when."""
    rows = session.execute(
        sa.select(
            ImageCompletion.image_id, ImageCompletion.user_id, ImageCompletion.created_at
        ).where(ImageCompletion.run_id == run_id)
    )
    return {row[0]: [(row[1], row[2])] for row in rows}


def units_in(session: Session, queue_id: int) -> tuple[set[tuple[int, int | None]], int]:
    """Return the (image, pose) pairs a queue has, and its next position."""
    rows = session.execute(
        sa.select(
            ReviewQueueItem.image_id, ReviewQueueItem.pose_id, ReviewQueueItem.position
        ).where(ReviewQueueItem.queue_id == queue_id)
    ).all()
    return {(row[0], row[1]) for row in rows}, max((row[2] for row in rows), default=-1) + 1


def add_items(session: Session, rows: Sequence[dict[str, object]]) -> None:
    """Store items."""
    for start in range(0, len(rows), ROWS_AT_ONCE):
        session.execute(sa.insert(ReviewQueueItem), rows[start : start + ROWS_AT_ONCE])
