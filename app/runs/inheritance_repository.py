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


_new, _old, _new_match, _old_match = aliased(Pose), aliased(Pose), aliased(Match), aliased(Match)
_PLACES = [
    getattr(pose, name)
    for pose in (_new, _old)
    for name in ("lat_deg", "lon_deg", "center_height_m", "heading_deg")
]
# Asked for every batch inside its transaction, so it is put together once.
_LIKE = (
    sa.select(_new.id, Review, *_PLACES)
    .options(lazyload(Review.user))
    .join(_new_match, _new_match.id == _new.match_id)
    .join(_old_match, _old_match.detection_id == _new_match.detection_id)
    .join(_old, _old.match_id == _old_match.id)
    .join(Review, Review.pose_id == _old.id)
    .where(
        _new.run_id == sa.bindparam("run_id"),
        _new.image_id.in_(sa.bindparam("image_ids", expanding=True)),
        _old.run_id != sa.bindparam("run_id"),
        _old.image_id == _new.image_id,
        # Not by its index: a ferry is in thousands of poses, a detection in one a run.
        _old.mmsi + 0 == _new.mmsi,
        Review.replaced_at.is_(None),
        Review.inherited_from_id.is_(None),
    )
    .order_by(Review.id)
)


def inherit(session: Session, run_id: int, image_ids: Sequence[int]) -> int:
    """Give the new poses of some images their like's reviews in earlier runs; returns how many.

    Where runs differ in what a person said, the newest counts.
    """
    rows = session.execute(_LIKE, {"run_id": run_id, "image_ids": image_ids})
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
