"""Detectors against the boxes that people drew: the paper's table, from this installation's data.

A detector here is a model with one setting (a threshold on the score cuts its curve off). It is
judged on the images whose boxes are complete and that it has looked at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session

from app.detectors.service import IMPORTED_FAMILY
from app.domain.average_precision import Size
from app.domain.detection import DetectionSettings
from app.evaluation import detector_repository as repository
from app.evaluation import found_repository
from app.evaluation.decoding import DecodingChange, decoding_change
from app.evaluation.detector_figures import FiguresOn, figures_on
from app.evaluation.found_repository import FoundSet, TrueImage
from app.evaluation.selection import Selection
from app.tables.detection import Model
from app.tables.groundtruth import VesselClass


@dataclass(frozen=True, eq=False, slots=True)
class DetectorFigures:
    """A detector, what it was judged on, and how it did.

    `empty` images have no detection in an imported file that lists no images: they count as looked
    at, as long as it speaks of others that came with the same ground truth. `unseen` images have
    complete boxes, but the detector has not looked at them. `decoding`: what it costs that
    photographs were decoded smaller, where the same settings were tried on whole ones too.
    """

    model: Model
    settings: DetectionSettings | None
    images: int
    empty: int
    unseen: int
    figures: FiguresOn
    decoding: DecodingChange | None


@dataclass(frozen=True, eq=False, slots=True)
class DetectorTable:
    """All detectors that looked at complete images of a selection."""

    images: int
    images_complete: int
    boxes: Mapping[VesselClass, int]
    detectors: Sequence[DetectorFigures]


def detector_table(
    session: Session, chosen: Selection, *, model_id: int | None = None, file_id: int | None = None
) -> DetectorTable:
    """Judge all detectors that looked at images of a selection, or one of them."""
    images = repository.images(session, chosen, file_id)
    models = repository.models(session)
    only = next((sha256 for sha256, one in models.items() if one.id == model_id), "")
    sets = found_repository.sets(session, images, only if model_id is not None else None)
    by_detector: dict[tuple[str, str], list[FoundSet]] = {}
    for found in sets:
        by_detector.setdefault((found.model_sha256, found.settings_sha256), []).append(found)
    judged = [
        _judged(session, models[model_sha256], settings_sha256, images, by_detector)
        for model_sha256, settings_sha256 in by_detector
        if model_sha256 in models
    ]
    return DetectorTable(
        images=repository.count_images(session, chosen, file_id),
        images_complete=len(images),
        boxes=repository.count_by_class(session, [image.id for image in images]),
        detectors=sorted(judged, key=_best_first),
    )


def _best_first(one: DetectorFigures) -> tuple[float, int]:
    best = one.figures.sets[0].by_size[Size.ALL].ap
    return (-1.0 if best is None else -best, one.model.id)


def _judged(
    session: Session,
    model: Model,
    settings_sha256: str,
    images: Sequence[TrueImage],
    by_detector: Mapping[tuple[str, str], Sequence[FoundSet]],
) -> DetectorFigures:
    sets = by_detector[model.sha256, settings_sha256]
    seen = {found.image_sha256 for found in sets}
    looked_at = [image for image in images if image.content_sha256 in seen]
    empty = 0
    if model.family == IMPORTED_FAMILY and not model.signature.get("lists_images"):
        spoken_of = {(image.site_id, image.file_id) for image in looked_at}
        considered = [image for image in images if (image.site_id, image.file_id) in spoken_of]
        empty, looked_at = len(considered) - len(looked_at), considered
    figures = figures_on(session, looked_at, sets)
    settings = _settings(session, model, settings_sha256)
    decoding = None
    if settings is not None and settings.decoding_divisor > 1:
        whole = by_detector.get((model.sha256, replace(settings, decoding_divisor=1).sha256), ())
        decoding = decoding_change(session, images, whole, sets)
    return DetectorFigures(
        model=model,
        settings=settings,
        images=len(looked_at),
        empty=empty,
        unseen=len(images) - len(looked_at),
        figures=figures,
        decoding=decoding,
    )


def _settings(session: Session, model: Model, settings_sha256: str) -> DetectionSettings | None:
    """Return the settings behind a key, known from the detector's runs; None for imported ones."""
    usual = DetectionSettings()
    for parameters in repository.parameters_of_model(session, model.id):
        settings = DetectionSettings(
            score_threshold=parameters.get("score_threshold", usual.score_threshold),
            nms_iou=parameters.get("nms_iou", usual.nms_iou),
            class_ids=tuple(parameters.get("class_ids", usual.class_ids)),
            decoding_divisor=parameters.get("decoding_divisor", usual.decoding_divisor),
        )
        if settings.sha256 == settings_sha256:
            return settings
    return None
