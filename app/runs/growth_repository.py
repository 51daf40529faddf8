"""SQL of runs that grow: images that came later, and images to be fused again."""

from collections.abc import Collection, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.runs.removal_repository import remove_poses
from app.tables.imagery import Image
from app.tables.reviews import Correction, ImageCompletion, MissedVessel, Review
from app.tables.runs import Match, Pose, Run, RunImage, RunStatus, VesselStateRow


def take_new_images(session: Session, run: Run) -> int | None:
    """Add the images of a run's viewport that it has not; returns the first's position."""
    start = session.scalar(
        sa.select(sa.func.max(RunImage.position) + 1).where(RunImage.run_id == run.id)
    )
    known = sa.select(RunImage.image_id).where(RunImage.run_id == run.id)
    numbered = sa.select(
        sa.literal(run.id),
        Image.id,
        sa.func.row_number().over(order_by=(Image.captured_at, Image.id)) - 1 + (start or 0),
        Image.captured_at,
    ).where(
        Image.viewport_id == run.viewport_id, Image.deleted_at.is_(None), Image.id.not_in(known)
    )
    columns = ["run_id", "image_id", "position", "captured_at"]
    session.execute(sa.insert(RunImage).from_select(columns, numbered))
    count = session.scalar(
        sa.select(sa.func.max(RunImage.position) + 1).where(RunImage.run_id == run.id)
    )
    if (count or 0) == (start or 0):
        return None
    run.image_count = count or 0
    return start or 0


def untouched(session: Session, run_id: int, begin: datetime, end: datetime) -> Sequence[int]:
    """Return a run's done images of a time on which nobody has judged or drawn anything."""
    of_image = Pose.image_id == RunImage.image_id, Pose.run_id == RunImage.run_id
    judged = sa.exists().where(Review.pose_id == Pose.id, *of_image)
    corrected = sa.exists().where(Correction.pose_id == Pose.id, *of_image)
    own = [
        sa.exists().where(table.image_id == RunImage.image_id, table.run_id == RunImage.run_id)
        for table in (MissedVessel, ImageCompletion)
    ]
    return session.scalars(
        sa.select(RunImage.image_id)
        .join(Image, Image.id == RunImage.image_id)
        .where(
            RunImage.run_id == run_id,
            RunImage.done_at.is_not(None),
            Image.captured_at >= begin,
            Image.captured_at <= end,
            ~judged,
            ~corrected,
            *(~condition for condition in own),
        )
    ).all()


def forget_outcome(session: Session, run_id: int, image_ids: Collection[int]) -> int:
    """Remove what a run made of some images, so that it is made again; returns the first position.

    What the detector found stays.
    """
    states = sa.select(VesselStateRow.id).where(
        VesselStateRow.run_id == run_id, VesselStateRow.image_id.in_(image_ids)
    )
    remove_poses(session, Pose.run_id == run_id, Pose.image_id.in_(image_ids))
    session.execute(sa.delete(Match).where(Match.vessel_state_id.in_(states)))
    session.execute(
        sa.delete(VesselStateRow).where(
            VesselStateRow.run_id == run_id, VesselStateRow.image_id.in_(image_ids)
        )
    )
    rows = sa.and_(RunImage.run_id == run_id, RunImage.image_id.in_(image_ids))
    session.execute(
        sa.update(RunImage)
        .where(rows)
        .values(done_at=None, error=None)
        .execution_options(synchronize_session=False)
    )
    return session.scalar(sa.select(sa.func.min(RunImage.position)).where(rows)) or 0


def queue_again(session: Session, run: Run, workflow_id: str) -> None:
    """Put a run that had ended back to the beginning of its life."""
    run.status, run.error, run.finished_at = RunStatus.QUEUED, None, None
    run.workflow_id = workflow_id
    session.flush()
