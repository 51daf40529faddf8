"""A detector's figures on some images, worked out from boxes and detections and kept by content.

Every vessel that a detector finds is one class, COCO's boat, so the boxes' classes only say which
of them are asked for. Figures are worked out again only when a box, an image or a detection is
another.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy.orm import Session

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
from app.evaluation import found_repository as repository
from app.evaluation.found_repository import FoundSet, TrueImage
from app.evaluation.kept import Kept
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
class FiguresOn:
    """A detector's figures on some images; `by_class`: a class alone, boxes of others ignored."""

    detections: int
    sets: Sequence[SetFigures]
    by_class: Mapping[VesselClass, Precision]


_kept: Kept[FiguresOn] = Kept(256)


def figures_on(
    session: Session, images: Sequence[TrueImage], sets: Sequence[FoundSet]
) -> FiguresOn:
    """Return how a detector did on images: figures of each class set and of each class alone."""
    set_of = {found.image_sha256: found for found in sets}
    return _kept.get(_key(images, sets), lambda: _work_out(session, images, set_of))


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
) -> FiguresOn:
    place = {image.id: index for index, image in enumerate(images)}
    rows = repository.boxes(session, [image.id for image in images])
    truth = _true_boxes(rows, place)
    classes = np.array([row[7].value for row in rows], dtype=np.str_)
    images_of: dict[int, list[int]] = {}
    for index, image in enumerate(images):
        if image.content_sha256 in set_of:
            images_of.setdefault(set_of[image.content_sha256].id, []).append(index)
    found = _detected(repository.detections(session, list(images_of)), images_of)
    alone = [ClassSet(one.value, (one,), ignores_others=True) for one in VesselClass]
    questions = [_question(class_set, classes, size) for class_set in CLASS_SETS for size in Size]
    questions += [_question(class_set, classes, Size.ALL) for class_set in alone]
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
        everywhere = questions[: len(CLASS_SETS) * len(Size) : len(Size)]
        renumbered = list(outcomes(plain, found, everywhere, len(images)))
    sizes = list(Size)
    return FiguresOn(
        detections=len(found.score),
        sets=[
            _figures(class_set, dict(zip(sizes, answers[n * len(sizes) :], strict=False)), again)
            for n, (class_set, again) in enumerate(zip(CLASS_SETS, renumbered, strict=True))
        ],
        by_class=dict(zip(VesselClass, map(precision, answers[-len(alone) :]), strict=True)),
    )


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
