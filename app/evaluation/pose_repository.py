"""SQL of poses against truth, known or drawn: plain columns, because there are many."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.evaluation.review_repository import of_images, of_poses
from app.evaluation.selection import Selection
from app.tables.detection import Detection
from app.tables.groundtruth import GroundTruthBox, GroundTruthImage, VesselTruth
from app.tables.imagery import Image
from app.tables.runs import Match, Pose, Run, RunImage

_AT_ONCE = 500


class PoseRow(NamedTuple):
    """A pose of the pipeline with the detection that it was made of, px."""

    id: int
    run_id: int
    image_id: int
    mmsi: int
    centroid_in_cam_m: Sequence[float]
    rotvec_cam_from_vessel: Sequence[float]
    length_m: float
    width_m: float
    height_m: float
    heading_deg: float
    position_covariance_in_enu_m2: Sequence[Sequence[float]] | None
    heading_sigma_deg: float | None
    height_sigma_m: float | None
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float


class Outline(NamedTuple):
    """A pose's projected corners and its detection, px, in an image of a size."""

    id: int
    run_id: int
    image_id: int
    corners_in_image_px: Sequence[Sequence[float]]
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    width_px: int
    height_px: int


class DrawnBox(NamedTuple):
    """A box that a person drew in a photograph that is here, px."""

    id: int
    image_id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float


_POSE = (
    Pose.id,
    Pose.run_id,
    Pose.image_id,
    Pose.mmsi,
    Pose.centroid_in_cam_m,
    Pose.rotvec_cam_from_vessel,
    Pose.length_m,
    Pose.width_m,
    Pose.height_m,
    Pose.heading_deg,
    Pose.position_covariance_in_enu_m2,
    Pose.heading_sigma_deg,
    Pose.height_sigma_m,
)
_DETECTION = (Detection.x1_px, Detection.y1_px, Detection.x2_px, Detection.y2_px)


def _joined(*columns: Any) -> sa.Select[Any]:  # noqa: ANN401  columns of several tables
    return (
        sa.select(*columns)
        .join(Match, Match.id == Pose.match_id)
        .join(Detection, Detection.id == Match.detection_id)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
    )


def poses_with_truth(session: Session, chosen: Selection) -> list[PoseRow]:
    """Return the poses of a selection in images whose truth is known."""
    known = sa.exists().where(VesselTruth.image_id == Pose.image_id)
    statement = _joined(*_POSE, *_DETECTION).where(known, *of_poses(chosen)).order_by(Pose.id)
    return [PoseRow(*row) for row in session.execute(statement)]


def poses_of_runs(session: Session, run_ids: Sequence[int]) -> list[PoseRow]:
    """Return all poses of some runs."""
    statement = _joined(*_POSE, *_DETECTION).where(Pose.run_id.in_(run_ids)).order_by(Pose.id)
    return [PoseRow(*row) for row in session.execute(statement)]


def images_of_runs(session: Session, run_ids: Sequence[int]) -> dict[int, list[int]]:
    """Return the images that some runs have done, by run."""
    statement = (
        sa.select(RunImage.run_id, RunImage.image_id)
        .join(Image, Image.id == RunImage.image_id)
        .where(RunImage.run_id.in_(run_ids), RunImage.done_at.is_not(None))
        .where(Image.deleted_at.is_(None))
    )
    found: dict[int, list[int]] = {}
    for run_id, image_id in session.execute(statement):
        found.setdefault(run_id, []).append(image_id)
    return found


def chosen_images(session: Session, chosen: Selection) -> dict[int, list[int]]:
    """Return the images with known truth that runs of a selection have done, by run."""
    statement = (
        sa.select(RunImage.run_id, RunImage.image_id)
        .join(Image, Image.id == RunImage.image_id)
        .join(Run, Run.id == RunImage.run_id)
        .where(
            RunImage.done_at.is_not(None),
            sa.exists().where(VesselTruth.image_id == RunImage.image_id),
            *of_images(chosen, RunImage.image_id, RunImage.run_id),
        )
    )
    found: dict[int, list[int]] = {}
    for run_id, image_id in session.execute(statement):
        found.setdefault(run_id, []).append(image_id)
    return found


def truths(session: Session, image_ids: Sequence[int]) -> list[VesselTruth]:
    """Return what is known to be true in images."""
    found: list[VesselTruth] = []
    for start in range(0, len(image_ids), _AT_ONCE):
        statement = sa.select(VesselTruth).where(
            VesselTruth.image_id.in_(image_ids[start : start + _AT_ONCE])
        )
        found += session.scalars(statement.order_by(VesselTruth.id))
    return found


def outlines(session: Session, chosen: Selection) -> list[Outline]:
    """Return the poses of a selection in photographs that people drew boxes in."""
    drawn = sa.exists().where(
        GroundTruthImage.image_id == Pose.image_id,
        GroundTruthBox.ground_truth_image_id == GroundTruthImage.id,
        GroundTruthBox.deleted_at.is_(None),
    )
    columns = (Pose.id, Pose.run_id, Pose.image_id, Pose.corners_in_image_px, *_DETECTION)
    statement = _joined(*columns, Image.width_px, Image.height_px).where(drawn, *of_poses(chosen))
    return [Outline(*row) for row in session.execute(statement.order_by(Pose.id))]


def drawn_boxes(session: Session, image_ids: Sequence[int]) -> dict[int, list[DrawnBox]]:
    """Return the boxes that people drew, crowds left out, by photograph."""
    found: dict[int, list[DrawnBox]] = {}
    for start in range(0, len(image_ids), _AT_ONCE):
        statement = (
            sa.select(
                GroundTruthBox.id,
                GroundTruthImage.image_id,
                GroundTruthBox.x1_px,
                GroundTruthBox.y1_px,
                GroundTruthBox.x2_px,
                GroundTruthBox.y2_px,
            )
            .join(GroundTruthBox.image)
            .where(
                GroundTruthImage.image_id.in_(image_ids[start : start + _AT_ONCE]),
                GroundTruthBox.deleted_at.is_(None),
                GroundTruthBox.is_crowd.is_(False),
            )
        )
        for box_id, image_id, *place in session.execute(statement.order_by(GroundTruthBox.id)):
            if image_id is not None:  # only such were asked for
                found.setdefault(image_id, []).append(DrawnBox(box_id, image_id, *place))
    return found
