"""SQL of withholding: a run's matches that nobody shall take for ordinary ones.

A match made by a wrong clock names the wrong vessel, so it is taken back with its pose, and the
vessel says why it has none. What a person has judged, drawn or asked for stays, with a flag.
"""

from collections.abc import Collection

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import now
from app.runs.removal_repository import remove_poses
from app.tables.reviews import Correction, Review
from app.tables.runs import Match, Pose, VesselStateRow

CLOCK_SUSPECT = "clock_suspect"


def withhold(session: Session, run_id: int, image_ids: Collection[int]) -> int:
    """Take back a run's matches on some images; returns how many."""
    by_person = sa.or_(
        Pose.person_made,
        sa.exists().where(Review.pose_id == Pose.id, Review.inherited_from_id.is_(None)),
        sa.exists().where(Correction.pose_id == Pose.id),
    )
    poses = sa.select(Pose).where(Pose.run_id == run_id, Pose.image_id.in_(image_ids))
    for kept in session.scalars(poses.where(by_person)):
        if CLOCK_SUSPECT not in kept.flags:
            kept.flags = [*kept.flags, CLOCK_SUSPECT]
            kept.changed_at = now()
    going = session.execute(
        sa.select(Pose.id, Pose.match_id, Match.vessel_state_id)
        .join(Match, Match.id == Pose.match_id)
        .where(Pose.run_id == run_id, Pose.image_id.in_(image_ids), ~by_person)
    ).all()
    session.flush()
    remove_poses(session, Pose.id.in_([row[0] for row in going]))
    session.execute(sa.delete(Match).where(Match.id.in_([row[1] for row in going])))
    session.execute(
        sa.update(VesselStateRow)
        .where(VesselStateRow.id.in_([row[2] for row in going]))
        .values(outcome=CLOCK_SUSPECT)
        .execution_options(synchronize_session=False)
    )
    return len(going)
