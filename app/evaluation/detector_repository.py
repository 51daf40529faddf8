"""SQL of detectors' figures: complete ground truth, and what detectors found in those images."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.evaluation.selection import Selection
from app.tables.detection import Detection, DetectionSet, Model
from app.tables.groundtruth import GroundTruthBox, GroundTruthImage, VesselClass
from app.tables.imagery import Image
from app.tables.runs import Run, RunImage

_AT_ONCE = 500


@dataclass(frozen=True, slots=True)
class TrueImage:
    """A complete image: the key of its detections, and what changes when it is changed."""

    id: int
    content_sha256: str
    version: int
    site_id: int
    file_id: int | None


@dataclass(frozen=True, slots=True)
class FoundSet:
    """What one detector with one setting found in an image."""

    id: int
    image_sha256: str
    model_sha256: str
    settings_sha256: str
    created_at: datetime


def images(session: Session, chosen: Selection, file_id: int | None) -> list[TrueImage]:
    """Return the complete images of a selection, in the order pycocotools would take them."""
    statement = sa.select(
        GroundTruthImage.id,
        GroundTruthImage.content_sha256,
        GroundTruthImage.version,
        GroundTruthImage.site_id,
        GroundTruthImage.file_id,
    ).where(*_conditions(chosen, file_id), GroundTruthImage.is_complete)
    order = (GroundTruthImage.file_id, GroundTruthImage.coco_id, GroundTruthImage.id)
    return [TrueImage(*row) for row in session.execute(statement.order_by(*order))]


def complete_images_of_site(session: Session, site_id: int) -> list[TrueImage]:
    """Return the complete images of a site, photograph here or not."""
    statement = (
        sa.select(
            GroundTruthImage.id,
            GroundTruthImage.content_sha256,
            GroundTruthImage.version,
            GroundTruthImage.site_id,
            GroundTruthImage.file_id,
        )
        .where(GroundTruthImage.site_id == site_id, GroundTruthImage.is_complete)
        .order_by(GroundTruthImage.id)
    )
    return [TrueImage(*row) for row in session.execute(statement)]


def has_sets(session: Session, model_sha256: str, settings_sha256s: Sequence[str]) -> bool:
    """Whether a detector looked at anything with one of these settings."""
    some = sa.select(DetectionSet.id).where(
        DetectionSet.model_sha256 == model_sha256,
        DetectionSet.settings_sha256.in_(settings_sha256s),
    )
    return session.scalar(some.limit(1)) is not None


def count_images(session: Session, chosen: Selection, file_id: int | None) -> int:
    """Count the images of a selection with ground truth, complete or not."""
    statement = sa.select(sa.func.count(GroundTruthImage.id))
    return session.scalar(statement.where(*_conditions(chosen, file_id))) or 0


def _conditions(chosen: Selection, file_id: int | None) -> list[sa.ColumnElement[bool]]:
    asked = chosen.asked
    photographs = _photographs(chosen)
    here = GroundTruthImage.image_id.in_(photographs)
    by_photograph = (asked.camera_id, asked.viewport_id, asked.since, asked.until, asked.run_id)
    is_absent = GroundTruthImage.image_id.is_(None)
    found = [here if any(by_photograph) else sa.or_(is_absent, here)]
    if chosen.site_ids is not None:
        found.append(GroundTruthImage.site_id.in_(chosen.site_ids))
    if asked.site_id is not None:
        found.append(GroundTruthImage.site_id == asked.site_id)
    if file_id is not None:
        found.append(GroundTruthImage.file_id == file_id)
    return found


def _photographs(chosen: Selection) -> sa.Select[int]:
    asked = chosen.asked
    statement = sa.select(Image.id).where(Image.deleted_at.is_(None))
    if asked.camera_id is not None:
        statement = statement.where(Image.camera_id == asked.camera_id)
    if asked.viewport_id is not None:
        statement = statement.where(Image.viewport_id == asked.viewport_id)
    if asked.since is not None:
        statement = statement.where(Image.captured_at >= asked.since)
    if asked.until is not None:
        statement = statement.where(Image.captured_at < asked.until)
    if asked.run_id is not None:
        of_run = sa.select(RunImage.image_id).where(
            RunImage.run_id == asked.run_id, RunImage.done_at.is_not(None)
        )
        statement = statement.where(Image.id.in_(of_run))
    return statement


def boxes(session: Session, image_ids: Sequence[int]) -> list[tuple[Any, ...]]:
    """Return image id, x1, y1, x2, y2 px, area px², crowd, class and COCO id of all boxes."""
    columns = (
        GroundTruthBox.ground_truth_image_id,
        GroundTruthBox.x1_px,
        GroundTruthBox.y1_px,
        GroundTruthBox.x2_px,
        GroundTruthBox.y2_px,
        GroundTruthBox.area_px2,
        GroundTruthBox.is_crowd,
        GroundTruthBox.vessel_class,
        GroundTruthBox.coco_id,
    )
    found: list[tuple[Any, ...]] = []
    for start in range(0, len(image_ids), _AT_ONCE):
        some = image_ids[start : start + _AT_ONCE]
        statement = sa.select(*columns).where(
            GroundTruthBox.ground_truth_image_id.in_(some), GroundTruthBox.deleted_at.is_(None)
        )
        found += [tuple(row) for row in session.execute(statement.order_by(GroundTruthBox.id))]
    return found


def count_by_class(session: Session, image_ids: Sequence[int]) -> dict[VesselClass, int]:
    """Count the boxes of images by class."""
    counts = dict.fromkeys(VesselClass, 0)
    for start in range(0, len(image_ids), _AT_ONCE):
        statement = (
            sa.select(GroundTruthBox.vessel_class, sa.func.count())
            .where(
                GroundTruthBox.ground_truth_image_id.in_(image_ids[start : start + _AT_ONCE]),
                GroundTruthBox.deleted_at.is_(None),
            )
            .group_by(GroundTruthBox.vessel_class)
        )
        for vessel_class, count in session.execute(statement):
            counts[vessel_class] += count
    return counts


def sets(session: Session, images: Sequence[TrueImage], model_sha256: str | None) -> list[FoundSet]:
    """Return what detectors found in images, by one detector or by all."""
    keys = sorted({image.content_sha256 for image in images})
    found: list[FoundSet] = []
    for start in range(0, len(keys), _AT_ONCE):
        statement = sa.select(
            DetectionSet.id,
            DetectionSet.image_sha256,
            DetectionSet.model_sha256,
            DetectionSet.settings_sha256,
            DetectionSet.created_at,
        ).where(DetectionSet.image_sha256.in_(keys[start : start + _AT_ONCE]))
        if model_sha256 is not None:
            statement = statement.where(DetectionSet.model_sha256 == model_sha256)
        found += [FoundSet(*row) for row in session.execute(statement)]
    return found


def detections(session: Session, set_ids: Sequence[int]) -> list[tuple[Any, ...]]:
    """Return set id, x1, y1, x2, y2 px and score of all detections, in the order they came."""
    columns = (
        Detection.detection_set_id,
        Detection.x1_px,
        Detection.y1_px,
        Detection.x2_px,
        Detection.y2_px,
        Detection.score,
    )
    found: list[tuple[Any, ...]] = []
    for start in range(0, len(set_ids), _AT_ONCE):
        some = set_ids[start : start + _AT_ONCE]
        statement = sa.select(*columns).where(Detection.detection_set_id.in_(some))
        found += [tuple(row) for row in session.execute(statement.order_by(Detection.id))]
    return found


def models(session: Session) -> dict[str, Model]:
    """Return the detectors by content; of several with the same bytes the first."""
    found = session.scalars(sa.select(Model).order_by(Model.id.desc()))
    return {model.sha256: model for model in found}


def parameters_of_model(session: Session, model_id: int) -> list[dict[str, Any]]:
    """Return the parameters of a detector's runs."""
    return list(session.scalars(sa.select(Run.parameters).where(Run.model_id == model_id)))
