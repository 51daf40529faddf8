"""SQL of two runs side by side: what each made of its images, image by image."""

from collections.abc import Collection, Mapping
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.domain.pose_changes import PlacedPose
from app.tables.detection import Detection
from app.tables.groundtruth import GroundTruthImage, VesselTruth
from app.tables.imagery import Image
from app.tables.reviews import Review
from app.tables.runs import Match, Pose, Run, RunImage, VesselStateRow

_AT_ONCE = 1000
_PRESENT = Image.deleted_at.is_(None)


def done_images(session: Session, run_id: int) -> list[int]:
    """Return the images that a run has done, in order of time."""
    statement = (
        sa.select(RunImage.image_id)
        .join(Image, Image.id == RunImage.image_id)
        .where(RunImage.run_id == run_id, RunImage.done_at.is_not(None), _PRESENT)
        .order_by(Image.captured_at, Image.id)
    )
    return list(session.scalars(statement))


def poses(session: Session, run_id: int) -> list[PlacedPose]:
    """Return the poses that the pipeline made in a run, each with its detection's box."""
    statement = (
        sa.select(
            Pose.id,
            Pose.image_id,
            Match.detection_id,
            Pose.mmsi,
            Detection.x1_px,
            Detection.y1_px,
            Detection.x2_px,
            Detection.y2_px,
            Pose.lat_deg,
            Pose.lon_deg,
            Pose.center_height_m - Pose.height_m / 2,
            Pose.heading_deg,
        )
        .join(Match, Match.id == Pose.match_id)
        .join(Detection, Detection.id == Match.detection_id)
        .join(Image, Image.id == Pose.image_id)
        .where(Pose.run_id == run_id, Pose.person_made.is_(False), _PRESENT)
        .order_by(Pose.id)
    )
    return [
        PlacedPose(*row[:4], (row[4], row[5], row[6], row[7]), *row[8:12])
        for row in session.execute(statement)
    ]


def detections(session: Session, run_id: int) -> Mapping[int, int]:
    """Count the detections that a run rests on, by image."""
    statement = (
        sa.select(RunImage.image_id, sa.func.count())
        .join(Detection, Detection.detection_set_id == RunImage.detection_set_id)
        .where(RunImage.run_id == run_id)
        .group_by(RunImage.image_id)
    )
    return {row[0]: row[1] for row in session.execute(statement)}


def matches(session: Session, run_id: int) -> Mapping[int, int]:
    """Count the matches that the pipeline made in a run, by image; those by people left out."""
    statement = (
        sa.select(VesselStateRow.image_id, sa.func.count())
        .select_from(Match)
        .join(VesselStateRow, VesselStateRow.id == Match.vessel_state_id)
        .outerjoin(Pose, Pose.match_id == Match.id)
        .where(Match.run_id == run_id, Pose.person_made.is_not(True))
        .group_by(VesselStateRow.image_id)
    )
    return {row[0]: row[1] for row in session.execute(statement)}


def outcomes(session: Session, run_id: int) -> Mapping[str, Mapping[int, int]]:
    """Count the vessels heard near a run's images by what became of them, by image."""
    statement = (
        sa.select(VesselStateRow.outcome, VesselStateRow.image_id, sa.func.count())
        .where(VesselStateRow.run_id == run_id)
        .group_by(VesselStateRow.outcome, VesselStateRow.image_id)
    )
    found: dict[str, dict[int, int]] = {}
    for outcome, image_id, count in session.execute(statement):
        found.setdefault(outcome, {})[image_id] = count
    return found


def image_names(
    session: Session, image_ids: Collection[int]
) -> Mapping[int, tuple[str, datetime | None]]:
    """Return file name and time of some images."""
    wanted = sorted(image_ids)
    found: dict[int, tuple[str, datetime | None]] = {}
    for start in range(0, len(wanted), _AT_ONCE):
        rows = session.execute(
            sa.select(Image.id, Image.file_name, Image.captured_at).where(
                Image.id.in_(wanted[start : start + _AT_ONCE])
            )
        )
        found |= {row[0]: (row[1], row[2]) for row in rows}
    return found


def fingerprint(session: Session, run_ids: Collection[int]) -> str:
    """Return a text that changes with whatever a comparison of runs follows from."""
    count = sa.func.count
    questions = (
        sa.select(RunImage.run_id, count(), count(RunImage.done_at), sa.func.max(RunImage.done_at))
        .join(Image, Image.id == RunImage.image_id)
        .where(RunImage.run_id.in_(run_ids), _PRESENT)
        .group_by(RunImage.run_id)
        .order_by(RunImage.run_id),
        sa.select(Pose.run_id, count(), sa.func.max(Pose.id), sa.func.sum(Pose.id))
        .where(Pose.run_id.in_(run_ids))
        .group_by(Pose.run_id)
        .order_by(Pose.run_id),
        sa.select(VesselStateRow.run_id, VesselStateRow.outcome, count())
        .where(VesselStateRow.run_id.in_(run_ids))
        .group_by(VesselStateRow.run_id, VesselStateRow.outcome)
        .order_by(VesselStateRow.run_id, VesselStateRow.outcome),
        sa.select(count(), count(Review.replaced_at), sa.func.max(Review.id))
        .join(Pose, Pose.id == Review.pose_id)
        .where(Pose.run_id.in_(run_ids)),
        sa.select(
            count(), sa.func.sum(GroundTruthImage.version), sa.func.max(GroundTruthImage.id)
        ).where(GroundTruthImage.site_id.in_(sa.select(Run.site_id).where(Run.id.in_(run_ids)))),
        sa.select(sa.func.max(VesselTruth.id)),
    )
    return repr([session.execute(question).all() for question in questions])
