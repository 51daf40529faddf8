"""What goes with what: the rows that one deletion takes, and how many of each kind."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.ais import AisFile, AisPosition, AisStatic
from app.tables.calibration import CameraCalibration
from app.tables.clock import ClockOffset
from app.tables.deletion import DeletableAlone
from app.tables.detection import DetectionSet, Model
from app.tables.feeds import AisFeed
from app.tables.groundtruth import GroundTruthBox, GroundTruthFile, GroundTruthImage
from app.tables.imagery import Image
from app.tables.imports import ImageImport
from app.tables.live import RetentionRule, StandingRun, WatchedFile, WatchedFolder
from app.tables.notes import Comment
from app.tables.practice import CalibrationSet, JudgedPose, PracticeAttempt
from app.tables.queues import ReviewQueue, ReviewQueueItem
from app.tables.registration import Landmark, Registration
from app.tables.reviews import Correction, MissedVessel, Review
from app.tables.runs import Pose, Run
from app.tables.sites import Camera, Site, Viewport
from app.tables.water import WaterLevel
from app.tables.webhooks import Webhook

DELETABLE: Mapping[str, type[Any]] = {
    "site": Site,
    "camera": Camera,
    "viewport": Viewport,
    "run": Run,
    "import": ImageImport,
    "image": Image,
    "ais_file": AisFile,
    "calibration_set": CalibrationSet,
    "comment": Comment,
    "feed": AisFeed,
    "ground_truth_file": GroundTruthFile,
    "landmark": Landmark,
    "missed_vessel": MissedVessel,
    "model": Model,
    "retention_rule": RetentionRule,
    "review_queue": ReviewQueue,
    "standing_run": StandingRun,
    "watched_folder": WatchedFolder,
    "water_levels": WaterLevel,
}
ALONE: tuple[type[DeletableAlone], ...] = (
    Comment,
    MissedVessel,
    ReviewQueue,
    CalibrationSet,
    StandingRun,
    WatchedFolder,
    RetentionRule,
    WaterLevel,
    GroundTruthImage,
    GroundTruthFile,
    Landmark,
)
# Runs rest on registrations and models, and images on viewports: they are removed in this order.
CHILDREN_FIRST: tuple[type[Any], ...] = (
    *ALONE,
    AisFile,
    Run,
    Image,
    Viewport,
    Camera,
    Site,
    Model,
)
Ids = sa.Select[int]


@dataclass(frozen=True, slots=True)
class Extent:
    """The ids of all that one deletion takes, by table; a table that is not named loses nothing."""

    rows: Mapping[type[Any], Ids]

    def of(self, table: type[Any]) -> Ids:
        """Return the ids a table loses."""
        return self.rows.get(table, sa.select(table.id).where(sa.false()))


def extent(entity: str, ids: Collection[int]) -> Extent:
    """Return what goes with some rows of one kind."""
    table = DELETABLE[entity]
    if table is ImageImport:  # the batch itself stays, and can be brought back there too
        return Extent({Image: _images_of(ids)})
    if table is AisFeed:  # its row stays for good, because its reports say that they came by it
        return Extent({})
    if table is WaterLevel:  # a series has no row of its own: it is named by its site
        return Extent({WaterLevel: sa.select(WaterLevel.id).where(WaterLevel.site_id.in_(ids))})
    rows: dict[type[Any], Ids] = {table: sa.select(table.id).where(table.id.in_(ids))}
    if GroundTruthFile in rows:
        of_files = GroundTruthImage.file_id.in_(rows[GroundTruthFile])
        rows[GroundTruthImage] = sa.select(GroundTruthImage.id).where(of_files)
    if Site in rows:
        rows[Camera] = sa.select(Camera.id).where(Camera.site_id.in_(rows[Site]))
        rows[AisFile] = sa.select(AisFile.id).where(AisFile.site_id.in_(rows[Site]))
    if Camera in rows:
        rows[Viewport] = sa.select(Viewport.id).where(Viewport.camera_id.in_(rows[Camera]))
        rows[Image] = sa.select(Image.id).where(Image.camera_id.in_(rows[Camera]))
    if Viewport in rows:
        rows[Run] = sa.select(Run.id).where(Run.viewport_id.in_(rows[Viewport]))
    return Extent(rows)


def _images_of(import_ids: Collection[int]) -> Ids:
    return (
        sa.select(Image.id)
        .join(ImageImport, ImageImport.id == Image.import_id)
        .where(ImageImport.id.in_(import_ids), Image.camera_id == ImageImport.camera_id)
    )


def counts(session: Session, entity: str, going: Extent) -> dict[str, int]:
    """Count what goes along, in words for people; kinds without any are left out."""
    table = DELETABLE[entity]
    if table is AisFeed or table is AisFile or issubclass(table, DeletableAlone):
        statements = _small_statements(going).get(table, {})
    else:
        statements = _statements(going)
    found = {name: session.scalar(statement) or 0 for name, statement in statements.items()}
    return {name: count for name, count in found.items() if count and name != table.__tablename__}


def _statements(going: Extent) -> dict[str, sa.Select[int]]:
    """Return what counts all that goes with a site, camera, viewport, run or images."""
    poses = sa.or_(Pose.run_id.in_(going.of(Run)), Pose.image_id.in_(going.of(Image)))
    missed = sa.or_(
        MissedVessel.run_id.in_(going.of(Run)), MissedVessel.image_id.in_(going.of(Image))
    )
    cameras = going.of(Camera)
    sites, runs, viewports = going.of(Site), going.of(Run), going.of(Viewport)
    return {
        "cameras": _count(Camera, Camera.id.in_(cameras)),
        "viewports": _count(Viewport, Viewport.id.in_(viewports)),
        "registrations": _count(Registration, Registration.viewport_id.in_(viewports)),
        "images": _count(Image, Image.id.in_(going.of(Image))),
        "runs": _count(Run, Run.id.in_(runs)),
        "poses": _count(Pose, poses),
        "reviews": _count(Review, Review.pose_id == Pose.id, poses),
        "corrections": _count(Correction, Correction.pose_id == Pose.id, poses),
        "missed vessels": _count(MissedVessel, missed),
        "comments": _count(Comment, Comment.image_id.in_(going.of(Image))),
        "calibrations": _count(CameraCalibration, CameraCalibration.camera_id.in_(cameras)),
        "clock corrections": _count(ClockOffset, ClockOffset.camera_id.in_(cameras)),
        "AIS recordings": _count(AisFile, AisFile.id.in_(going.of(AisFile))),
        "landmarks": _count(Landmark, Landmark.site_id.in_(sites)),
        "live feeds": _count(AisFeed, AisFeed.site_id.in_(sites), AisFeed.removed_at.is_(None)),
        "water level readings": _count(WaterLevel, WaterLevel.site_id.in_(sites)),
        "ground truth files": _count(GroundTruthFile, GroundTruthFile.site_id.in_(sites)),
        "retention rules": _count(
            RetentionRule, RetentionRule.site_id.in_(sites) | RetentionRule.camera_id.in_(cameras)
        ),
        "webhooks": _count(Webhook, Webhook.site_id.in_(sites)),
        "watched folders": _count(WatchedFolder, WatchedFolder.camera_id.in_(cameras)),
        "standing runs": _count(StandingRun, StandingRun.viewport_id.in_(viewports)),
        "review queues": _count(ReviewQueue, ReviewQueue.run_id.in_(runs)),
        "calibration sets": _count(CalibrationSet, CalibrationSet.run_id.in_(runs)),
    }


def _small_statements(going: Extent) -> dict[type[Any], dict[str, sa.Select[int]]]:
    """Return what counts all that goes with a smaller thing, by its table."""
    images, sets = going.of(GroundTruthImage), going.of(CalibrationSet)
    detectors = sa.select(Model.sha256).where(Model.id.in_(going.of(Model)))
    return {
        AisFile: {
            "positions": _count(AisPosition, AisPosition.file_id.in_(going.of(AisFile))),
            "static reports": _count(AisStatic, AisStatic.file_id.in_(going.of(AisFile))),
        },
        CalibrationSet: {
            "judged poses": _count(JudgedPose, JudgedPose.set_id.in_(sets)),
            "attempts": _count(PracticeAttempt, PracticeAttempt.set_id.in_(sets)),
        },
        GroundTruthFile: {
            "photographs": _count(GroundTruthImage, GroundTruthImage.id.in_(images)),
            "annotations": _count(
                GroundTruthBox,
                GroundTruthBox.ground_truth_image_id.in_(images),
                GroundTruthBox.deleted_at.is_(None),
            ),
        },
        Model: {
            "looked at photographs": _count(DetectionSet, DetectionSet.model_sha256.in_(detectors))
        },
        ReviewQueue: {
            "queue items": _count(
                ReviewQueueItem, ReviewQueueItem.queue_id.in_(going.of(ReviewQueue))
            )
        },
        WatchedFolder: {
            "remembered files": _count(
                WatchedFile, WatchedFile.folder_id.in_(going.of(WatchedFolder))
            )
        },
        WaterLevel: {"readings": _count(WaterLevel, WaterLevel.id.in_(going.of(WaterLevel)))},
    }


def _count(table: type[Any], *conditions: sa.ColumnElement[bool]) -> sa.Select[int]:
    return sa.select(sa.func.count(table.id)).where(*conditions)
