"""Average precision and recall of a detector against boxes that people drew: COCO's measure.

It is the measure of pycocotools, figure for figure: detections of an image are taken from the most
certain down, each takes the free box that it covers best, and is right when it covers it by at
least an IoU threshold (0.5 to 0.95 in steps of 0.05). Going down the detections of all images, the
precision at 101 levels of recall is averaged. A box may be *ignored*: it need not be found, and a
detection on it is neither right nor wrong. A crowd is ignored, and any number of detections may lie
on it. Boxes of another size than asked for are ignored in the figures by size.

The detector is asked for vessels, not for kinds of vessels: it knows one class (COCO's boat), so
what a *question* chooses is which boxes count. pycocotools goes image by image, threshold by
threshold; here the n-th detections of all images are matched together, for all thresholds and all
questions at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray

IOU_THRESHOLDS = np.linspace(0.5, 0.95, 10)
RECALL_LEVELS = np.linspace(0.0, 1.0, 101)
MOST_DETECTIONS = 100
# pycocotools lets an IoU that is short of a threshold by this much pass.
_EXACT = 1 - 1e-10
_PAIRS_AT_ONCE = 2_000_000
_TINY = np.spacing(1)


class Size(StrEnum):
    """COCO's sizes by the area of a box in px²."""

    ALL = "all"
    SMALL = "small"
    MEDIUM = "medium"
    LARGE = "large"


AREAS_PX2 = {
    Size.ALL: (0.0, 1e10),
    Size.SMALL: (0.0, 32.0**2),
    Size.MEDIUM: (32.0**2, 96.0**2),
    Size.LARGE: (96.0**2, 1e10),
}


@dataclass(frozen=True, eq=False)
class TrueBoxes:
    """Boxes by people (n): image index, x y width height (n, 4) px, area px² and crowd flags.

    `has_id_0`: pycocotools marks what was not found with 0, so a box whose id is 0 is taken by the
    detection on it, and that detection counts as wrong.
    """

    image: IntArray
    xywh_px: FloatArray
    area_px2: FloatArray
    is_crowd: BoolArray
    has_id_0: BoolArray


@dataclass(frozen=True, eq=False)
class Detected:
    """A detector's boxes (n): image index, x y width height (n, 4) px, scores."""

    image: IntArray
    xywh_px: FloatArray
    score: FloatArray


@dataclass(frozen=True, eq=False)
class Question:
    """Which boxes are there at all and which of them need not be found, (n) each; of which size."""

    is_present: BoolArray
    is_ignored: BoolArray
    size: Size = Size.ALL


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of the detections, most certain first: (thresholds, detections) each.

    `wanted` are the boxes to be found in each image; `image` the detections' images.
    """

    image: IntArray
    score: FloatArray
    is_right: BoolArray
    is_ignored: BoolArray
    wanted: IntArray


@dataclass(frozen=True, slots=True)
class Precision:
    """COCO's figures, fractions of one; None where there is no box to be found."""

    ap: float | None
    ap50: float | None
    ap75: float | None
    ar100: float | None
    boxes: int


def outcomes(
    truth: TrueBoxes, found: Detected, questions: Sequence[Question], images: int
) -> list[Outcome]:
    """Match detections with boxes for each question; indices of images lie below `images`."""
    found = _most_certain(found)
    ignored = np.array([_ignored(truth, question) for question in questions])
    present = np.array([question.is_present for question in questions])
    matched, on_ignored = _match(truth, found, present, ignored)
    order = np.argsort(-found.score, kind="stable")
    detected_px2 = found.xywh_px[:, 2] * found.xywh_px[:, 3]
    answers = []
    for number, question in enumerate(questions):
        low, high = AREAS_PX2[question.size]
        is_other_size = (detected_px2 < low) | (detected_px2 > high)
        dropped = on_ignored[number] | (~matched[number] & is_other_size)
        wanted = truth.image[present[number] & ~ignored[number]]
        answers.append(
            Outcome(
                found.image[order],
                found.score[order],
                (matched[number] & ~dropped)[:, order],
                dropped[:, order],
                np.bincount(wanted, minlength=images),
            )
        )
    return answers


def precision(outcome: Outcome) -> Precision:
    """Sum up an outcome."""
    boxes = int(outcome.wanted.sum())
    if boxes == 0:
        return Precision(None, None, None, None, 0)
    by_threshold = precision_at_recall(outcome).mean(axis=1)
    return Precision(
        ap=float(by_threshold.mean()),
        ap50=float(by_threshold[0]),
        ap75=float(by_threshold[5]),
        ar100=float((outcome.is_right.sum(axis=1) / boxes).mean()),
        boxes=boxes,
    )


def precision_at_recall(outcome: Outcome) -> FloatArray:
    """Return the precision at 101 levels of recall (thresholds, 101), as high as it ever gets."""
    boxes = outcome.wanted.sum()
    right = np.cumsum(outcome.is_right, axis=1, dtype=np.float64)
    wrong = np.cumsum(~outcome.is_right & ~outcome.is_ignored, axis=1, dtype=np.float64)
    precisions = right / (right + wrong + _TINY)
    precisions = np.maximum.accumulate(precisions[:, ::-1], axis=1)[:, ::-1]
    answer = np.zeros((len(right), len(RECALL_LEVELS)))
    for threshold, recalls in enumerate(right / boxes):
        at = np.searchsorted(recalls, RECALL_LEVELS, side="left")
        reached = at < len(recalls)
        answer[threshold, reached] = precisions[threshold, at[reached]]
    return answer


def _most_certain(found: Detected) -> Detected:
    """Sort by image and falling score, and keep the hundred first of each image."""
    order = np.lexsort((-found.score, found.image))
    image = found.image[order]
    kept = order[_rank(image) < MOST_DETECTIONS]
    return Detected(found.image[kept], found.xywh_px[kept], found.score[kept])


def _rank(groups: IntArray) -> IntArray:
    """Return each member's number within its group, from 0; groups stand together."""
    starts = np.flatnonzero(np.r_[True, groups[1:] != groups[:-1]]) if len(groups) else groups
    sizes = np.diff(np.r_[starts, len(groups)])
    return np.arange(len(groups)) - np.repeat(starts, sizes)


def _ignored(truth: TrueBoxes, question: Question) -> BoolArray:
    low, high = AREAS_PX2[question.size]
    other_size = (truth.area_px2 < low) | (truth.area_px2 > high)
    return question.is_ignored | truth.is_crowd | other_size


def _match(
    truth: TrueBoxes, found: Detected, present: BoolArray, ignored: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Tell which detections took a box, and which took an ignored one: (questions, T, n) each."""
    detection, box, iou = _pairs(truth, found)
    shape = (len(present), len(IOU_THRESHOLDS))
    matched = np.zeros((*shape, len(found.score)), dtype=np.bool_)
    on_ignored = np.zeros_like(matched)
    taken = np.zeros((*shape, len(truth.image)), dtype=np.bool_)
    needed = np.minimum(IOU_THRESHOLDS, _EXACT)[None, :, None, None]
    for members, boxes, ious in _rounds(found.image, detection, box, iou):
        is_ignored = ignored[:, boxes][:, None]
        is_free = ~taken[:, :, boxes] | truth.is_crowd[boxes]
        may = is_free & (ious >= needed) & present[:, boxes][:, None]
        # A box that counts goes before an ignored one; then the overlap decides, then the later.
        worth = np.where(may, ious + 2.0 * ~is_ignored, -1.0)[..., ::-1]
        best = boxes.shape[1] - 1 - worth.argmax(axis=-1)
        took = worth.max(axis=-1) >= 0
        chosen = np.take_along_axis(np.broadcast_to(boxes, may.shape), best[..., None], -1)[..., 0]
        matched[:, :, members] = took
        question, threshold, member = np.nonzero(took)
        taken[question, threshold, chosen[took]] = True
        on_ignored[question, threshold, members[member]] = ignored[question, chosen[took]]
        matched[:, :, members] &= ~truth.has_id_0[chosen]
    return matched, on_ignored


def _rounds(
    image_of: IntArray, detection: IntArray, box: IntArray, iou: FloatArray
) -> list[tuple[IntArray, IntArray, FloatArray]]:
    """Split candidate pairs into rounds: the first detection of each image, the second, ...

    Each round gives its detections (m), and their boxes and overlaps (m, k), filled up with -1.
    """
    members, first = np.unique(detection, return_index=True)
    sizes = np.diff(np.r_[first, len(detection)])
    turn = _rank(image_of[members])
    rounds = []
    for number in range(int(turn.max(initial=-1)) + 1):
        at = np.flatnonzero(turn == number)
        column = np.arange(sizes[at].max())
        is_there = column < sizes[at][:, None]
        index = np.where(is_there, first[at][:, None] + column, 0)
        rounds.append((members[at], box[index], np.where(is_there, iou[index], -1.0)))
    return rounds


def _pairs(truth: TrueBoxes, found: Detected) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the pairs of a detection and a box that overlap enough for the lowest threshold."""
    by_image = np.argsort(truth.image, kind="stable")
    begin = np.searchsorted(truth.image[by_image], found.image, side="left")
    count = np.searchsorted(truth.image[by_image], found.image, side="right") - begin
    ends = np.cumsum(count)
    pieces = []
    start = 0
    while start < len(count):
        done = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + _PAIRS_AT_ONCE, side="right")))
        detection = np.repeat(np.arange(start, stop), count[start:stop])
        within = _rank(detection)
        box = by_image[np.repeat(begin[start:stop], count[start:stop]) + within]
        iou = _overlap(found.xywh_px[detection], truth.xywh_px[box], truth.is_crowd[box])
        near = iou >= min(IOU_THRESHOLDS[0], _EXACT)
        pieces.append((detection[near], box[near], iou[near]))
        start = stop
    if not pieces:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    detections, boxes, ious = zip(*pieces, strict=True)
    return np.concatenate(detections), np.concatenate(boxes), np.concatenate(ious)


def _overlap(detected: FloatArray, true: FloatArray, is_crowd: BoolArray) -> FloatArray:
    """Return the IoU (n) of boxes x y width height (n, 4); with a crowd, over the detection."""
    ends = np.minimum(detected[:, :2] + detected[:, 2:], true[:, :2] + true[:, 2:])
    sides = ends - np.maximum(detected[:, :2], true[:, :2])
    shared = np.where((sides > 0).all(axis=1), sides[:, 0] * sides[:, 1], 0.0)
    detected_px2 = detected[:, 2] * detected[:, 3]
    whole = np.where(is_crowd, detected_px2, detected_px2 + true[:, 2] * true[:, 3] - shared)
    return np.divide(shared, whole, out=np.zeros_like(shared), where=whole > 0)
