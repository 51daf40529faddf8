"""Average precision of an ONNX detector on harbours it has never seen, by COCO's own code.

Images go through Quaymark's own detector (`worker.inference.families.yolox`): letterbox, ONNX
Runtime, decoding, suppression. The harbours are as `make_harbour` gives them by default, AIS aside,
but with the hulls of the judging fleet and with seeds training never uses. What counts as a target
says `targets.py`; ignored vessels are crowd regions of COCO.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from app.domain.detection import DetectionSettings
from app.simulation.detections import COCO_BOAT_CATEGORY, CocoResult, coco_results
from app.simulation.harbour import make_harbour
from app.simulation.settings import HarbourSettings, TrafficSettings
from app.simulation.ship_plans import Fleet
from tools.train_harbour_detector.targets import boxes_of
from worker.inference.families.yolox import YoloxDetector
from worker.inference.session import OnnxSession, SessionSettings

_LEAST_SCORE = 0.01  # average precision wants the whole curve, not only what the product shows


def measure(
    model: Path, fleet: Fleet, seeds: range, images: int, size_px: tuple[int, int], threads: int
) -> dict[str, object]:
    """Return figures and what they were measured on."""
    session = OnnxSession(model, SessionSettings(threads=threads))
    detector = YoloxDetector(session, DetectionSettings(score_threshold=_LEAST_SCORE))
    silent = replace(TrafficSettings(), no_ais_share=1.0, moored_with_ais_share=0.0)
    settings = replace(HarbourSettings(), traffic=silent, fleet=fleet)
    pictures, truths, found = [], [], []
    for seed in seeds:
        for frame in make_harbour(seed, images, *size_px, settings=settings).frames:
            seen = frame.observe()
            number = len(pictures) + 1
            pictures.append({"id": number, "width": size_px[0], "height": size_px[1]})
            for box in boxes_of(seen.truth, size_px[0]):
                truths.append(_annotation(len(truths) + 1, number, box))
            found += coco_results([(number, detector.detect(seen.image))])
    curve = _evaluated(pictures, truths, found)
    targets = sum(not truth["iscrowd"] for truth in truths)
    return {
        "model": model.name, "fleet": fleet.value, "seeds": [seeds.start, seeds.stop],
        "images": len(pictures), "size_px": size_px, "targets": targets,
        "ignored": len(truths) - targets, **_figures(curve),
    }  # fmt: skip


def _annotation(number: int, image: int, box: np.ndarray) -> dict[str, object]:
    x1, y1, x2, y2, target = (float(value) for value in box)
    return {
        "id": number, "image_id": image, "category_id": COCO_BOAT_CATEGORY,
        "iscrowd": int(not target), "bbox": [x1, y1, x2 - x1, y2 - y1],
        "area": (x2 - x1) * (y2 - y1),
    }  # fmt: skip


def _evaluated(
    pictures: list[dict[str, int]],
    truths: list[dict[str, object]],
    found: list[CocoResult],
) -> COCOeval:
    truth = COCO()
    truth.dataset = {
        "info": {}, "images": pictures, "annotations": truths,
        "categories": [{"id": COCO_BOAT_CATEGORY, "name": "boat"}],
    }  # fmt: skip
    truth.createIndex()
    curve = COCOeval(truth, truth.loadRes(found), "bbox")
    curve.evaluate()
    curve.accumulate()
    curve.summarize()
    return curve


def _figures(curve: COCOeval) -> dict[str, float]:
    """Name COCO's figures, and count what the product's default threshold finds at IoU 0.5."""
    least = DetectionSettings().score_threshold
    found = right = targets = 0
    for image in curve.evalImgs:
        if image is None or image["aRng"] != curve.params.areaRng[0]:
            continue
        shown = np.array(image["dtScores"]) >= least
        counted = shown & ~image["dtIgnore"][0].astype(bool)
        found += int(counted.sum())
        right += int((counted & (image["dtMatches"][0] > 0)).sum())
        targets += int((np.array(image["gtIgnore"]) == 0).sum())
    names = ("AP50:95", "AP50", "AP75", "AP50:95 small", "AP50:95 medium", "AP50:95 large")
    figures = dict(zip(names, (round(float(v), 4) for v in curve.stats[:6]), strict=True))
    return figures | {
        f"precision at score {least}": round(right / max(1, found), 4),
        f"recall at score {least}": round(right / max(1, targets), 4),
    }


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--model", type=Path, required=True, help="the .onnx file")
    parser.add_argument("--fleet", type=Fleet, default=Fleet.JUDGING, choices=list(Fleet))
    parser.add_argument("--seeds", type=int, nargs=2, default=(900, 912), metavar=("FIRST", "END"))
    parser.add_argument("--images", type=int, default=12, help="images of each harbour")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 960), metavar=("W", "H"))
    parser.add_argument("--threads", type=int, default=1)
    wanted = parser.parse_args()
    figures = measure(
        wanted.model, wanted.fleet, range(*wanted.seeds), wanted.images, tuple(wanted.size),
        wanted.threads,
    )  # fmt: skip
    print(json.dumps(figures, indent=2))


if __name__ == "__main__":
    _main()
