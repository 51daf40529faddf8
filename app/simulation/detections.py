"""Detections as a detector of known quality would give them.

They stand in where no detector is at hand, and they tell apart what a detector does to the result
from what the method does. Boxes are the truth's silhouettes with noise on each edge; some vessels
are missed, some boxes show nothing.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from app.domain.detection import Detection
from app.simulation.settings import DetectorSettings
from app.simulation.truth import VesselClass, VesselTruth

COCO_BOAT_CATEGORY = 9  # COCO's own number; detectors count the classes from 0 and say 8

CocoResult = dict[str, int | float | list[float]]


def detect(
    rng: np.random.Generator,
    settings: DetectorSettings,
    truths: Iterable[VesselTruth],
    image_size_px: tuple[int, int],
) -> tuple[Detection, ...]:
    """Return detections of whole vessels (not of a convoy's single hulls), clipped to the image."""
    found = []
    for truth in truths:
        # All chances are drawn for every vessel, so that one setting does not reshuffle the rest.
        noise, missed, rest = rng.normal(0.0, 1.0, 4), rng.random(), rng.random()
        if truth.box_px is None or truth.class_name is VesselClass.SUBVESSEL:
            continue
        box = np.array(truth.box_px)
        size = box[2:] - box[:2]
        still = truth.class_name in {VesselClass.SHIP_MOORED, VesselClass.SHIP_PARTIAL}
        if (
            truth.visible_fraction < settings.least_visible_share
            or size.max() < settings.least_size_px
            or missed < settings.miss_share
            or (still and rest >= settings.moored_share)
        ):
            continue
        sigma = settings.edge_sigma_px + settings.edge_sigma_share * np.tile(size, 2)
        if settings.edge_sigma_px == 0 and settings.edge_sigma_share == 0:
            sigma = np.zeros(4)
        score = 0.55 + 0.4 * min(1.0, size.max() / 120) * truth.visible_fraction - 0.2 * rest**2
        found.append(_clipped(box + noise * sigma, min(0.99, score), image_size_px))
    width, height = image_size_px
    for _ in range(int(rng.poisson(settings.false_positives_per_image))):
        x, y = rng.uniform(0, width * 0.9), rng.uniform(0.2, 0.5) * height
        w = rng.uniform(0.02, 0.09) * width
        box = np.array([x, y, x + w, y + w * rng.uniform(0.2, 0.6)])
        found.append(_clipped(box, float(rng.uniform(0.26, 0.6)), image_size_px))
    kept = [d for d in found if d.x2_px - d.x1_px > 1 and d.y2_px - d.y1_px > 1]
    return tuple(sorted(kept, key=lambda d: -d.score))


def _clipped(
    box: np.ndarray[tuple[int], np.dtype[np.float64]], score: float, size_px: tuple[int, int]
) -> Detection:
    x1, y1, x2, y2 = np.clip(box, 0, (*size_px, *size_px))
    return Detection(float(x1), float(y1), float(x2), float(y2), round(score, 4))


def coco_results(
    image_ids_and_detections: Iterable[tuple[int, Sequence[Detection]]],
    category_id: int = COCO_BOAT_CATEGORY,
) -> list[CocoResult]:
    """Return detections as a COCO results list: image_id, category_id, bbox x y w h, score."""
    return [
        {
            "image_id": image_id,
            "category_id": category_id,
            "bbox": [d.x1_px, d.y1_px, d.x2_px - d.x1_px, d.y2_px - d.y1_px],
            "score": d.score,
        }
        for image_id, detections in image_ids_and_detections
        for d in detections
    ]
