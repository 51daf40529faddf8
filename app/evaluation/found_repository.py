"""SQL of boxes that people drew and of what detectors found in the same images."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.detection import Detection, DetectionSet
from app.tables.groundtruth import GroundTruthBox, GroundTruthImage

AT_ONCE = 500


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
    for start in range(0, len(image_ids), AT_ONCE):
        some = image_ids[start : start + AT_ONCE]
        statement = sa.select(*columns).where(
            GroundTruthBox.ground_truth_image_id.in_(some), GroundTruthBox.deleted_at.is_(None)
        )
        found += [tuple(row) for row in session.execute(statement.order_by(GroundTruthBox.id))]
    return found


def sets(session: Session, images: Sequence[TrueImage], model_sha256: str | None) -> list[FoundSet]:
    """Return what detectors found in images, by one detector or by all."""
    keys = sorted({image.content_sha256 for image in images})
    found: list[FoundSet] = []
    for start in range(0, len(keys), AT_ONCE):
        statement = sa.select(
            DetectionSet.id,
            DetectionSet.image_sha256,
            DetectionSet.model_sha256,
            DetectionSet.settings_sha256,
            DetectionSet.created_at,
        ).where(DetectionSet.image_sha256.in_(keys[start : start + AT_ONCE]))
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
    for start in range(0, len(set_ids), AT_ONCE):
        some = set_ids[start : start + AT_ONCE]
        statement = sa.select(*columns).where(Detection.detection_set_id.in_(some))
        found += [tuple(row) for row in session.execute(statement.order_by(Detection.id))]
    return found
