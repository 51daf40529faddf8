"""SQL of corrections: versions count up for each pose, the newest counts."""

from collections.abc import Mapping, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.detection import Detection
from app.tables.imagery import Image
from app.tables.reviews import Correction
from app.tables.runs import Match, Pose, Run, RunImage, VesselStateRow


def counting(session: Session, pose_ids: Sequence[int]) -> Mapping[int, Correction]:
    """Return the correction that counts for each pose that has one."""
    newest = (
        sa.select(Correction.pose_id, sa.func.max(Correction.version).label("version"))
        .where(Correction.pose_id.in_(pose_ids))
        .group_by(Correction.pose_id)
        .subquery()
    )
    rows = session.scalars(
        sa.select(Correction)
        .join(
            newest,
            (newest.c.pose_id == Correction.pose_id) & (newest.c.version == Correction.version),
        )
        .where(Correction.deleted_at.is_(None))
    )
    return {correction.pose_id: correction for correction in rows}


def all_of(session: Session, pose_id: int) -> Sequence[Correction]:
    """Return all corrections of a pose, deleted ones too, newest first."""
    return session.scalars(
        sa.select(Correction)
        .where(Correction.pose_id == pose_id)
        .order_by(Correction.version.desc())
    ).all()


def newest(session: Session, pose_id: int) -> Correction | None:
    """Return the newest correction of a pose, deleted or not."""
    return session.scalars(
        sa.select(Correction)
        .where(Correction.pose_id == pose_id)
        .order_by(Correction.version.desc())
        .limit(1)
    ).first()


def state_row(session: Session, run_id: int, image_id: int, mmsi: int) -> VesselStateRow | None:
    """Return the state of a vessel at an image of a run."""
    return session.scalar(
        sa.select(VesselStateRow).where(
            VesselStateRow.run_id == run_id,
            VesselStateRow.image_id == image_id,
            VesselStateRow.mmsi == mmsi,
        )
    )


def detection_of_run(
    session: Session, run_id: int, detection_id: int
) -> tuple[Detection, Image, Run] | None:
    """Return a detection with its present image and run, which must have used it."""
    row = session.execute(
        sa.select(Detection, Image, Run)
        .join(RunImage, RunImage.detection_set_id == Detection.detection_set_id)
        .join(Image, Image.id == RunImage.image_id)
        .join(Run, Run.id == RunImage.run_id)
        .where(Run.id == run_id, Detection.id == detection_id, Image.deleted_at.is_(None))
        .order_by(RunImage.position)
        .limit(1)
    ).one_or_none()
    return None if row is None else (row[0], row[1], row[2])


def pose_in_the_way(
    session: Session, run_id: int, image_id: int, *, detection_id: int, mmsi: int
) -> Pose | None:
    """Return a pose of an image in a run that has the detection or the vessel already."""
    return session.scalars(
        sa.select(Pose)
        .join(Match, Match.id == Pose.match_id)
        .where(
            Pose.run_id == run_id,
            ((Match.detection_id == detection_id) & (Pose.image_id == image_id))
            | ((Pose.image_id == image_id) & (Pose.mmsi == mmsi)),
        )
        .limit(1)
    ).first()


def water_level_m(session: Session, run_id: int, image_id: int) -> float | None:
    """Return the ellipsoidal water level that a run put an image's vessels on, where it is kept."""
    return session.scalar(
        sa.select(RunImage.water_level_m).where(
            RunImage.run_id == run_id, RunImage.image_id == image_id
        )
    )
