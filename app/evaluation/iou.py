"""How far projected boxes cover what people drew, by the grade that people gave: the paper's plot.

The human box is compared with the smallest rectangle around the projected 3D box, never with the
detection that the pose was fitted to. The detection only says which human box is meant: the one
that it covers best. A vessel that leaves the frame is drawn as far as the edge, so the rectangle is
cut off there too, unless `clip` is switched off.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from sqlalchemy.orm import Session

from app.domain.metrics import Box, best_covered, box_iou
from app.domain.pose_errors import drawn_interval
from app.evaluation import pose_repository as repository
from app.evaluation import review_repository
from app.evaluation.pose_repository import DrawnBox, Outline
from app.evaluation.selection import Selection
from app.tables.reviews import Grade


@dataclass(frozen=True, slots=True)
class Pair:
    """A pose, the human box of its vessel, the grade and how far they cover each other."""

    pose_id: int
    run_id: int
    image_id: int
    box_id: int
    grade: Grade
    iou: float


@dataclass(frozen=True, slots=True)
class GradeFigures:
    """The pairs of a grade: mean with its 95 % interval, and quartiles."""

    count: int
    mean: float
    mean_interval: tuple[float, float] | None
    low: float
    median: float
    high: float


@dataclass(frozen=True, slots=True)
class IouFigures:
    """All pairs, and how many poses there are that could have had one."""

    pairs: Sequence[Pair]
    by_grade: Mapping[Grade, GradeFigures | None]
    poses: int
    ungraded: int
    without_box: int
    clipped: bool


def iou_figures(session: Session, chosen: Selection, *, clip: bool) -> IouFigures:
    """Compare the graded poses of a selection with the boxes that people drew."""
    outlines = repository.outlines(session, chosen)
    boxes = repository.drawn_boxes(session, sorted({one.image_id for one in outlines}))
    grades: dict[int, Grade] = {}
    for verdict in review_repository.verdicts(session, chosen):
        grades[verdict.pose_id] = verdict.grade
    pairs, without_box, ungraded = [], 0, 0
    for outline in outlines:
        grade = grades.get(outline.id)
        if grade is None:
            ungraded += 1
            continue
        pair = _pair(outline, boxes.get(outline.image_id, []), grade, clip=clip)
        if pair is None:
            without_box += 1
        else:
            pairs.append(pair)
    return IouFigures(
        pairs=pairs,
        by_grade={
            grade: _figures([pair for pair in pairs if pair.grade is grade]) for grade in Grade
        },
        poses=len(outlines),
        ungraded=ungraded,
        without_box=without_box,
        clipped=clip,
    )


def _pair(outline: Outline, boxes: Sequence[DrawnBox], grade: Grade, *, clip: bool) -> Pair | None:
    rectangle = _rectangle(outline, clip=clip)
    detected = (outline.x1_px, outline.y1_px, outline.x2_px, outline.y2_px)
    places = [(box.x1_px, box.y1_px, box.x2_px, box.y2_px) for box in boxes]
    best = best_covered(detected, places)
    if best is None or rectangle is None:
        return None
    return Pair(
        pose_id=outline.id,
        run_id=outline.run_id,
        image_id=outline.image_id,
        box_id=boxes[best].id,
        grade=grade,
        iou=box_iou(rectangle, places[best]),
    )


def _rectangle(outline: Outline, *, clip: bool) -> Box | None:
    """Return the smallest rectangle around the projected corners; None where one has no place."""
    corners = outline.corners_in_image_px
    if any(value is None or not isfinite(value) for corner in corners for value in corner):
        return None
    us, vs = [u for u, _ in corners], [v for _, v in corners]
    x1, y1, x2, y2 = min(us), min(vs), max(us), max(vs)
    if not clip:
        return x1, y1, x2, y2
    return max(x1, 0.0), max(y1, 0.0), min(x2, outline.width_px), min(y2, outline.height_px)


def _figures(pairs: Sequence[Pair]) -> GradeFigures | None:
    if not pairs:
        return None
    values = np.array([pair.iou for pair in pairs])
    low, median, high = (float(value) for value in np.percentile(values, [25, 50, 75]))
    return GradeFigures(
        count=len(pairs),
        mean=float(values.mean()),
        mean_interval=drawn_interval(values, [pair.image_id for pair in pairs], np.mean),
        low=low,
        median=median,
        high=high,
    )
