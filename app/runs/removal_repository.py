"""SQL of poses that a run takes back: what is removed leaves word, so that exports can tell."""

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import now
from app.tables.runs import Pose, RemovedPose


def remove_poses(session: Session, *conditions: sa.ColumnElement[bool]) -> None:
    """Remove the poses of which all conditions hold."""
    going = sa.select(
        Pose.id, Pose.run_id, Pose.image_id, Pose.person_made, sa.literal(now())
    ).where(*conditions)
    columns = ["pose_id", "run_id", "image_id", "person_made", "removed_at"]
    session.execute(sa.insert(RemovedPose).from_select(columns, going))
    session.execute(sa.delete(Pose).where(*conditions).execution_options(synchronize_session=False))
