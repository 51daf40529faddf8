"""Average precision on random boxes, figure for figure as pycocotools gives it."""

import contextlib
import io
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from app.domain.average_precision import (
    Detected,
    Question,
    Size,
    TrueBoxes,
    outcomes,
    precision,
)


@dataclass
class Case:
    """Boxes and detections; `is_present` are the boxes of the classes that are asked for."""

    truth: TrueBoxes
    ids: np.ndarray
    is_ignored: np.ndarray
    is_present: np.ndarray
    found: Detected
    images: int


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Boxes on a coarse grid, so that overlaps, sizes and scores are often exactly equal."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    images = draw(st.integers(1, 4))
    boxes = draw(st.integers(0, 12))
    detections = draw(st.sampled_from([0, 3, 20, 60, 320]))
    step = draw(st.sampled_from([8.0, 16.0, 0.37]))
    xywh = np.ceil(rng.uniform(0, [200, 200, 130, 130], (boxes, 4)) / step) * step
    xywh[:, 2:] = np.maximum(xywh[:, 2:], step)
    of_box = rng.integers(0, max(boxes, 1), detections)
    near = xywh[of_box] if boxes else np.full((detections, 4), 50.0)
    near = near + np.round(rng.normal(0, draw(st.sampled_from([0.0, 4.0, 20.0])), near.shape))
    near[:, 2:] = np.maximum(near[:, 2:], 1.0)
    image = rng.integers(0, images, boxes)
    area = xywh[:, 2] * xywh[:, 3]
    edge = rng.random(boxes) < 0.2
    area[edge] = rng.choice([32.0**2, 96.0**2, 0.0], edge.sum())
    digits = draw(st.sampled_from([1, 8]))
    ids = np.arange(boxes) + draw(st.integers(0, 1))
    return Case(
        TrueBoxes(image, xywh, area, rng.random(boxes) < draw(st.sampled_from([0, 0.3])), ids == 0),
        ids,
        rng.random(boxes) < draw(st.sampled_from([0, 0.3])),
        rng.random(boxes) < draw(st.sampled_from([0, 0.7, 1])),
        Detected(
            image[of_box] if boxes else rng.integers(0, images, detections),
            near,
            np.round(rng.random(detections), digits),
        ),
        images,
    )


class WithIgnored(COCOeval):  # type: ignore[misc]
    """pycocotools, told which boxes need not be found: by itself it knows crowds only."""

    def _prepare(self) -> None:
        super()._prepare()
        for boxes in self._gts.values():
            for box in boxes:
                box["ignore"] = box["ignore"] or box["need_not"]


def by_pycocotools(case: Case) -> dict[Size, list[float]]:
    """Return AP, AP50, AP75 and AR100 of each size; -1 where there is nothing to find."""
    numbers = np.flatnonzero(case.is_present)
    truth = {
        "images": [{"id": n} for n in range(case.images)],
        "categories": [{"id": 1}],
        "annotations": [
            {
                "id": int(case.ids[n]),
                "image_id": int(case.truth.image[n]),
                "category_id": 1,
                "bbox": case.truth.xywh_px[n].tolist(),
                "area": float(case.truth.area_px2[n]),
                "iscrowd": int(case.truth.is_crowd[n]),
                "need_not": int(case.is_ignored[n]),
            }
            for n in numbers
        ],
    }
    rows = zip(case.found.image, case.found.xywh_px, case.found.score, strict=True)
    found = [
        {"image_id": int(i), "category_id": 1, "bbox": b.tolist(), "score": float(s)}
        for i, b, s in rows
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO()
        coco.dataset = truth
        coco.createIndex()
        results = coco.loadRes(found) if found else COCO()
        judge = WithIgnored(coco, results, "bbox")
        judge.params.imgIds, judge.params.catIds = list(range(case.images)), [1]
        judge.evaluate()
        judge.accumulate()
    curve, recall = judge.eval["precision"][:, :, 0, :, 2], judge.eval["recall"][:, 0, :, 2]
    return {
        size: [
            float(v.mean()) for v in (curve[..., n], curve[0, :, n], curve[5, :, n], recall[:, n])
        ]
        for n, size in enumerate(Size)
    }


@settings(max_examples=60, deadline=None)
@given(case=cases())
def test_every_figure_is_that_of_pycocotools(case: Case) -> None:
    """Crowds, ignored boxes, ties, empty classes, all sizes, an id of 0, more than 100 found."""
    questions = [Question(case.is_present, case.is_ignored, size) for size in Size]
    theirs = by_pycocotools(case)
    for size, outcome in zip(
        Size, outcomes(case.truth, case.found, questions, case.images), strict=True
    ):
        ours = precision(outcome)
        figures = [ours.ap, ours.ap50, ours.ap75, ours.ar100]
        assert [-1 if f is None else f for f in figures] == pytest.approx(theirs[size], abs=1e-6)
