"""The SQL of detectors and of detections that came from elsewhere."""

from collections.abc import Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.deletion import PRESENT
from app.tables.detection import Detection, DetectionSet, Model, ModelStatus
from app.tables.groundtruth import GroundTruthImage
from app.tables.identity import AuditEntry
from app.tables.imagery import Image
from app.tables.live import StandingRun
from app.tables.runs import Run

_IDS_AT_ONCE = 500
_LARGEST_IMAGE_ID = 2**31 - 1


def model(session: Session, model_id: int) -> Model | None:
    """Return a model by id."""
    return find(session, Model, model_id)


def model_of_name(session: Session, name: str) -> Model | None:
    """Return the model with this name."""
    return session.scalar(sa.select(Model).where(Model.name == name))


def model_of_content(session: Session, sha256: str) -> Model | None:
    """Return the first model with these bytes."""
    return session.scalars(
        sa.select(Model).where(Model.sha256 == sha256).order_by(Model.id).limit(1)
    ).first()


def models(
    session: Session, paging: Paging, status: ModelStatus | None
) -> tuple[Sequence[Model], str | None]:
    """Return a part of the list of models."""
    statement = sa.select(Model)
    if status is not None:
        statement = statement.where(Model.status == status)
    return fetch_page(session, statement, Model.id, paging)


def all_models(session: Session) -> Sequence[Model]:
    """Return all models by name."""
    return session.scalars(sa.select(Model).order_by(Model.name)).all()


def add_model(session: Session, values: Mapping[str, Any]) -> int | None:
    """Add a model and return its id; None when the name is taken.

    Whoever comes second with a name waits here until the first is done.
    """
    insert = (sqlite if session.get_bind().dialect.name == "sqlite" else postgresql).insert
    statement = (
        insert(Model)
        .values(**values)
        .on_conflict_do_nothing(index_elements=[Model.name], index_where=PRESENT)
        .returning(Model.id)
    )
    model_id: int | None = session.scalar(statement)
    return model_id


def set_outcome(
    session: Session,
    model_id: int,
    status: ModelStatus,
    reason: str | None,
    signature: Mapping[str, object],
    family: str | None,
) -> None:
    """Say what the probe found; a model that is no longer being probed stays as it is."""
    values: dict[str, object] = {
        "status": status,
        "reason": reason,
        "signature": dict(signature),
    }
    if family is not None:
        values["family"] = family
    session.execute(
        sa.update(Model)
        .where(Model.id == model_id, Model.status == ModelStatus.PROBING)
        .values(**values)
    )


def count_runs(session: Session, model_id: int) -> int:
    """Count the runs that use a model."""
    statement = sa.select(sa.func.count()).select_from(Run).where(Run.model_id == model_id)
    return session.scalar(statement) or 0


def count_sets(session: Session, sha256: str) -> int:
    """Count the images that a model has looked at."""
    statement = (
        sa.select(sa.func.count())
        .select_from(DetectionSet)
        .where(DetectionSet.model_sha256 == sha256)
    )
    return session.scalar(statement) or 0


def is_standing(session: Session, model_id: int) -> bool:
    """Whether a standing run detects with a model."""
    statement = sa.select(StandingRun.id).where(StandingRun.model_id == model_id).limit(1)
    return session.scalar(statement) is not None


def first_pulled_sha256(session: Session, name: str) -> str | None:
    """Return the SHA-256 that an official model had when it was pulled first."""
    entries = session.scalars(
        sa.select(AuditEntry)
        .where(AuditEntry.action == "pull", AuditEntry.entity == "model")
        .order_by(AuditEntry.id)
    )
    return next((str(e.details["sha256"]) for e in entries if e.details.get("name") == name), None)


def images_by_id(session: Session, image_ids: Sequence[int]) -> dict[int, Image]:
    """Return the images with these ids, deleted ones left out."""
    found: dict[int, Image] = {}
    known = [image_id for image_id in image_ids if image_id <= _LARGEST_IMAGE_ID]
    for start in range(0, len(known), _IDS_AT_ONCE):
        wanted = known[start : start + _IDS_AT_ONCE]
        statement = sa.select(Image).where(Image.id.in_(wanted), Image.deleted_at.is_(None))
        found |= {image.id: image for image in session.scalars(statement)}
    return found


def images_by_name(
    session: Session, names: Sequence[str], camera_id: int | None
) -> dict[str, list[Image]]:
    """Return the images with these file names, deleted ones left out."""
    found: dict[str, list[Image]] = {}
    for start in range(0, len(names), _IDS_AT_ONCE):
        wanted = names[start : start + _IDS_AT_ONCE]
        statement = sa.select(Image).where(Image.file_name.in_(wanted), Image.deleted_at.is_(None))
        if camera_id is not None:
            statement = statement.where(Image.camera_id == camera_id)
        for image in session.scalars(statement):
            found.setdefault(image.file_name, []).append(image)
    return found


def absent_by_name(session: Session, names: Sequence[str]) -> dict[str, list[GroundTruthImage]]:
    """Return the photographs with these names that people drew boxes in and that are not here.

    Of one that two files speak of the first is enough: detections are stored by its content.
    """
    found: dict[str, dict[str, GroundTruthImage]] = {}
    for start in range(0, len(names), _IDS_AT_ONCE):
        statement = sa.select(GroundTruthImage).where(
            GroundTruthImage.base_name.in_(names[start : start + _IDS_AT_ONCE]),
            GroundTruthImage.image_id.is_(None),
        )
        for image in session.scalars(statement.order_by(GroundTruthImage.id)):
            found.setdefault(image.base_name, {}).setdefault(image.content_sha256, image)
    return {name: list(images.values()) for name, images in found.items()}


def images_of_ground_truth(
    session: Session, coco_ids: Sequence[int]
) -> list[dict[int, GroundTruthImage]]:
    """Return the images with these ids for each ground truth file that has them all."""
    by_file: dict[int, dict[int, GroundTruthImage]] = {}
    for start in range(0, len(coco_ids), _IDS_AT_ONCE):
        statement = sa.select(GroundTruthImage).where(
            GroundTruthImage.coco_id.in_(coco_ids[start : start + _IDS_AT_ONCE]),
            GroundTruthImage.file_id.is_not(None),
        )
        for image in session.scalars(statement):
            by_file.setdefault(image.file_id or 0, {})[image.coco_id or 0] = image
    return [images for images in by_file.values() if len(images) == len(set(coco_ids))]


def add_detections(
    session: Session,
    model_sha256: str,
    settings_sha256: str,
    boxes_by_image: Mapping[str, Sequence[Mapping[str, Any]]],
) -> None:
    """Add a detection set for each image, by SHA-256, with its boxes as columns.

    Those that a deleted detector of the same content left are the same, and stay.
    """
    there = set(
        session.scalars(
            sa.select(DetectionSet.image_sha256).where(
                DetectionSet.model_sha256 == model_sha256,
                DetectionSet.settings_sha256 == settings_sha256,
            )
        )
    )
    new = {sha256: boxes for sha256, boxes in boxes_by_image.items() if sha256 not in there}
    rows = [
        {
            "image_sha256": image_sha256,
            "model_sha256": model_sha256,
            "settings_sha256": settings_sha256,
        }
        for image_sha256 in new
    ]
    if not rows:
        return
    statement = sa.insert(DetectionSet).returning(DetectionSet.id, DetectionSet.image_sha256)
    set_ids = {sha256: set_id for set_id, sha256 in session.execute(statement, rows)}
    boxes = [
        {"detection_set_id": set_ids[image_sha256], **box}
        for image_sha256, found in new.items()
        for box in found
    ]
    if boxes:
        session.execute(sa.insert(Detection), boxes)
