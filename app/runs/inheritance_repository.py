"""Verdicts that hold in a new run too, so that nobody judges the same box twice.

A pose of the same detection and the same vessel that hardly moved is the pose somebody judged
already. It inherits the reviews that stand for the earlier one, marked as inherited. Only what a
person said counts as a source, never what was inherited itself: many small moves of many runs must
not carry a verdict far away.
"""

from collections.abc import Sequence
from math import hypot
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased, lazyload

from app.domain.local_metres import offset_m
from app.tables.reviews import Review
from app.tables.runs import Match, Pose

LARGEST_MOVE_M = 0.5
LARGEST_TURN_DEG = 2.0


def inherit(session: Session, run_id: int, image_ids: Sequence[int]) -> int:
    """Give the new poses of some images their like's reviews in earlier runs; returns how many.

    Where runs differ in what a person said, the newest counts.
    """
    new, old, new_match, old_match = aliased(Pose), aliased(Pose), aliased(Match), aliased(Match)
    places = [
        getattr(pose, name)
        for pose in (new, old)
        for name in ("lat_deg", "lon_deg", "center_height_m", "heading_deg")
    ]
    rows = session.execute(
        sa.select(new.id, Review, *places)
        .options(lazyload(Review.user))
        .join(new_match, new_match.id == new.match_id)
        .join(old_match, old_match.detection_id == new_match.detection_id)
        .join(old, old.match_id == old_match.id)
        .join(Review, Review.pose_id == old.id)
        .where(
            new.run_id == run_id,
            new.image_id.in_(image_ids),
            old.run_id != run_id,
            old.image_id == new.image_id,
            old.mmsi == new.mmsi,
            Review.replaced_at.is_(None),
            Review.inherited_from_id.is_(None),
        )
        .order_by(Review.id)
    )
    inherited = {
        (pose_id, review.user_id): _copy(pose_id, review)
        for pose_id, review, *place in rows
        if _hardly_moved(*place)
    }
    if inherited:
        session.execute(sa.insert(Review), list(inherited.values()))
    return len(inherited)


def _copy(pose_id: int, review: Review) -> dict[str, Any]:
    """Return an inherited review's columns: what was said, by whom, when, by which guideline."""
    return {
        "pose_id": pose_id,
        "user_id": review.user_id,
        "grade": review.grade,
        "reasons": review.reasons,
        "comment": review.comment,
        "guideline_version": review.guideline_version,
        "inherited_from_id": review.id,
        "second_opinion": review.second_opinion,
        "settles": review.settles,
        "created_at": review.created_at,
    }


def _hardly_moved(*place: float) -> bool:
    """Whether two poses (latitude, longitude, height, heading each) are the same to a reviewer."""
    lat, lon, height, heading, old_lat, old_lon, old_height, old_heading = place
    move_m = hypot(*offset_m(old_lat, old_lon, lat, lon), height - old_height)
    turn_deg = abs((heading - old_heading + 180) % 360 - 180)
    return move_m < LARGEST_MOVE_M and turn_deg < LARGEST_TURN_DEG
