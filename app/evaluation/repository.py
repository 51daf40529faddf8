"""SQL of evaluation: generated poses beside what is known to be true."""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.groundtruth import VesselTruth
from app.tables.runs import Pose, RunImage


def poses(session: Session, run_ids: Sequence[int]) -> Sequence[Pose]:
    """Return the poses of some runs with their matches."""
    return session.scalars(sa.select(Pose).where(Pose.run_id.in_(run_ids)).order_by(Pose.id)).all()


def truths(session: Session, run_ids: Sequence[int]) -> Sequence[VesselTruth]:
    """Return the truth of all images that some runs have done."""
    images = sa.select(RunImage.image_id).where(
        RunImage.run_id.in_(run_ids), RunImage.done_at.is_not(None)
    )
    return session.scalars(
        sa.select(VesselTruth).where(VesselTruth.image_id.in_(images)).order_by(VesselTruth.id)
    ).all()
