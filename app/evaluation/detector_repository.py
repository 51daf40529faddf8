"""SQL of detectors' figures: complete ground truth, and what detectors found in those images."""

from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.evaluation.found_repository import AT_ONCE, TrueImage
from app.evaluation.selection import Selection
from app.tables.detection import Model
from app.tables.groundtruth import GroundTruthBox, GroundTruthImage, VesselClass
from app.tables.imagery import Image
from app.tables.runs import Run, RunImage


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


def count_by_class(session: Session, image_ids: Sequence[int]) -> dict[VesselClass, int]:
    """Count the boxes of images by class."""
    counts = dict.fromkeys(VesselClass, 0)
    for start in range(0, len(image_ids), AT_ONCE):
        statement = (
            sa.select(GroundTruthBox.vessel_class, sa.func.count())
            .where(
                GroundTruthBox.ground_truth_image_id.in_(image_ids[start : start + AT_ONCE]),
                GroundTruthBox.deleted_at.is_(None),
            )
            .group_by(GroundTruthBox.vessel_class)
        )
        for vessel_class, count in session.execute(statement):
            counts[vessel_class] += count
    return counts


def models(session: Session) -> dict[str, Model]:
    """Return the detectors by content; of several with the same bytes the first."""
    found = session.scalars(sa.select(Model).order_by(Model.id.desc()))
    return {model.sha256: model for model in found}


def parameters_of_model(session: Session, model_id: int) -> list[dict[str, Any]]:
    """Return the parameters of a detector's runs."""
    return list(session.scalars(sa.select(Run.parameters).where(Run.model_id == model_id)))
