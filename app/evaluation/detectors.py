"""Detectors against the boxes that people drew: the paper's table, from this installation's data.

A detector here is a model with one setting (a threshold on the score cuts its curve off). It is
judged on the images whose boxes are complete and that it has looked at; every vessel it finds is
one class, COCO's boat, so the boxes' classes only say which of them are asked for. Figures are kept
by content: they are worked out again only when a box, an image or a detection is another.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy.orm import Session

from app.detectors.service import IMPORTED_FAMILY
from app.domain.arrays import FloatArray
from app.domain.average_precision import (
    Detected,
    Outcome,
    Precision,
    Question,
    Size,
    TrueBoxes,
    outcomes,
    precision,
    precision_at_recall,
)
from app.domain.average_precision_interval import PrecisionIntervals, precision_intervals
from app.domain.detection import DetectionSettings
from app.evaluation import detector_repository as repository
from app.evaluation.detector_repository import FoundSet, TrueImage
from app.evaluation.kept import Kept
from app.evaluation.selection import Selection
from app.tables.detection import Model
from app.tables.groundtruth import VesselClass

MOVING = (VesselClass.SHIP, VesselClass.SHIP_LEAVING_FRAME, VesselClass.SUBVESSEL)


@dataclass(frozen=True, slots=True)
class ClassSet:
    """Which classes are to be found; the others are not there, or there but not asked for."""

    name: str
    classes: tuple[VesselClass, ...]
    ignores_others: bool


CLASS_SETS = (
    ClassSet("moving", MOVING, ignores_others=False),
    ClassSet("moving_others_ignored", MOVING, ignores_others=True),
    ClassSet("all", tuple(VesselClass), ignores_others=False),
)


@dataclass(frozen=True, eq=False, slots=True)
class SetFigures:
    """A detector's figures for a set of classes; `curve`: precision at 101 levels of recall.

    `renumbered` are the figures over all sizes if no box had the id 0, None where none has it.
    """

    class_set: ClassSet
    by_size: Mapping[Size, Precision]
    intervals: PrecisionIntervals | None
    curve: Mapping[str, Sequence[float]]
    renumbered: Precision | None


@dataclass(frozen=True, eq=False, slots=True)
class DetectorFigures:
    """A detector, what it was judged on, and how it did.

    `empty` images have no detection in an imported file that lists no images: they count as looked
    at, as long as it speaks of others that came with the same ground truth. `unseen` images have
    complete boxes, but the detector has not looked at them.
    """

    model: Model
    settings: DetectionSettings | None
    images: int
    empty: int
    unseen: int
    detections: int
    sets: Sequence[SetFigures]


@dataclass(frozen=True, eq=False, slots=True)
class DetectorTable:
    """All detectors that looked at complete images of a selection."""

    images: int
    images_complete: int
    boxes: Mapping[VesselClass, int]
    detectors: Sequence[DetectorFigures]


_kept: Kept[tuple[int, list[SetFigures]]] = Kept(256)


def detector_table(
    session: Session, chosen: Selection, *, model_id: int | None = None, file_id: int | None = None
) -> DetectorTable:
    """Judge all detectors that looked at images of a selection, or one of them."""
    images = repository.images(session, chosen, file_id)
    models = repository.models(session)
    only = next((sha256 for sha256, one in models.items() if one.id == model_id), "")
    sets = repository.sets(session, images, only if model_id is not None else None)
    by_detector: dict[tuple[str, str], list[FoundSet]] = {}
    for found in sets:
        by_detector.setdefault((found.model_sha256, found.settings_sha256), []).append(found)
    judged = [
        _judged(session, models[model_sha256], settings_sha256, images, found)
        for (model_sha256, settings_sha256), found in by_detector.items()
        if model_sha256 in models
    ]
    return DetectorTable(
        images=repository.count_images(session, chosen, file_id),
        images_complete=len(images),
        boxes=repository.count_by_class(session, [image.id for image in images]),
        detectors=sorted(judged, key=_best_first),
    )


def _best_first(one: DetectorFigures) -> tuple[float, int]:
    best = one.sets[0].by_size[Size.ALL].ap
    return (-1.0 if best is None else -best, one.model.id)


def _judged(
    session: Session,
    model: Model,
    settings_sha256: str,
    images: Sequence[TrueImage],
    sets: Sequence[FoundSet],
) -> DetectorFigures:
    set_of = {found.image_sha256: found for found in sets}
    looked_at = [image for image in images if image.content_sha256 in set_of]
    empty = 0
    if model.family == IMPORTED_FAMILY and not model.signature.get("lists_images"):
        spoken_of = {(image.site_id, image.file_id) for image in looked_at}
        considered = [image for image in images if (image.site_id, image.file_id) in spoken_of]
        empty, looked_at = len(considered) - len(looked_at), considered
    detections, by_set = _kept.get(
        _key(looked_at, sets), lambda: _work_out(session, looked_at, set_of)
    )
    return DetectorFigures(
        model=model,
        settings=_settings(session, model, settings_sha256),
        images=len(looked_at),
        empty=empty,
        unseen=len(images) - len(looked_at),
        detections=detections,
        sets=by_set,
    )


def _key(images: Sequence[TrueImage], sets: Sequence[FoundSet]) -> str:
    """Return a digest of what figures follow from: an edit is a version, a set never changes."""
    digest = hashlib.sha256()
    for image in images:
        digest.update(f"{image.id} {image.version} {image.content_sha256}\n".encode())
    for found in sorted(sets, key=lambda one: one.id):
        digest.update(f"{found.id} {found.image_sha256} {found.created_at}\n".encode())
    return digest.hexdigest()


def _work_out(
    session: Session, images: Sequence[TrueImage], set_of: Mapping[str, FoundSet]
) -> tuple[int, list[SetFigures]]:
    place = {image.id: index for index, image in enumerate(images)}
    rows = repository.boxes(session, [image.id for image in images])
    truth = _true_boxes(rows, place)
    classes = np.array([row[7].value for row in rows], dtype=np.str_)
    images_of: dict[int, list[int]] = {}
    for index, image in enumerate(images):
        if image.content_sha256 in set_of:
            images_of.setdefault(set_of[image.content_sha256].id, []).append(index)
    found = _detected(repository.detections(session, list(images_of)), images_of)
    questions = [_question(class_set, classes, size) for class_set in CLASS_SETS for size in Size]
    answers = outcomes(truth, found, questions, len(images))
    renumbered: list[Outcome | None] = [None] * len(CLASS_SETS)
    if truth.has_id_0.any():
        plain = TrueBoxes(
            truth.image,
            truth.xywh_px,
            truth.area_px2,
            truth.is_crowd,
            np.zeros_like(truth.is_crowd),
        )
        everywhere = [question for question in questions if question.size is Size.ALL]
        renumbered = list(outcomes(plain, found, everywhere, len(images)))
    sizes = list(Size)
    return len(found.score), [
        _figures(class_set, dict(zip(sizes, answers[n * len(sizes) :], strict=False)), again)
        for n, (class_set, again) in enumerate(zip(CLASS_SETS, renumbered, strict=True))
    ]


def _figures(
    class_set: ClassSet, by_size: Mapping[Size, Outcome], renumbered: Outcome | None
) -> SetFigures:
    everything = by_size[Size.ALL]
    curve: dict[str, Sequence[float]] = {}
    if everything.wanted.sum():
        levels = precision_at_recall(everything)
        curve = {
            "iou_50": [float(value) for value in levels[0]],
            "iou_75": [float(value) for value in levels[5]],
            "iou_50_95": [float(value) for value in levels.mean(axis=0)],
        }
    return SetFigures(
        class_set=class_set,
        by_size={size: precision(outcome) for size, outcome in by_size.items()},
        intervals=precision_intervals(everything),
        curve=curve,
        renumbered=None if renumbered is None else precision(renumbered),
    )


def _question(class_set: ClassSet, classes: npt.NDArray[np.str_], size: Size) -> Question:
    wanted = np.isin(classes, [one.value for one in class_set.classes])
    if class_set.ignores_others:
        return Question(np.ones(len(classes), dtype=np.bool_), ~wanted, size)
    return Question(wanted, np.zeros(len(classes), dtype=np.bool_), size)


def _true_boxes(rows: Sequence[tuple[Any, ...]], place: Mapping[int, int]) -> TrueBoxes:
    numbers = np.array([row[1:6] for row in rows], dtype=np.float64).reshape(-1, 5)
    return TrueBoxes(
        image=np.array([place[row[0]] for row in rows], dtype=np.intp),
        xywh_px=_xywh(numbers),
        area_px2=numbers[:, 4],
        is_crowd=np.array([row[6] for row in rows], dtype=np.bool_),
        has_id_0=np.array([row[8] == 0 for row in rows], dtype=np.bool_),
    )


def _detected(rows: Sequence[tuple[Any, ...]], images_of: Mapping[int, Sequence[int]]) -> Detected:
    """Put detections to their images; the same photograph may be ground truth in two files."""
    placed = [(index, row) for row in rows for index in images_of[row[0]]]
    numbers = np.array([row[1:6] for _, row in placed], dtype=np.float64).reshape(-1, 5)
    return Detected(
        image=np.array([index for index, _ in placed], dtype=np.intp),
        xywh_px=_xywh(numbers),
        score=numbers[:, 4],
    )


def _xywh(numbers: FloatArray) -> FloatArray:
    return np.column_stack([numbers[:, :2], numbers[:, 2:4] - numbers[:, :2]])


def _settings(session: Session, model: Model, settings_sha256: str) -> DetectionSettings | None:
    """Return the settings behind a key, known from the detector's runs; None for imported ones."""
    usual = DetectionSettings()
    for parameters in repository.parameters_of_model(session, model.id):
        settings = DetectionSettings(
            score_threshold=parameters.get("score_threshold", usual.score_threshold),
            nms_iou=parameters.get("nms_iou", usual.nms_iou),
            class_ids=tuple(parameters.get("class_ids", usual.class_ids)),
        )
        if settings.sha256 == settings_sha256:
            return settings
    return None
