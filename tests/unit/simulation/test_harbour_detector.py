"""The demo harbour's own detector: a drop-in YOLOX-Nano that finds vessels it has never seen."""

from pathlib import Path

import numpy as np
import onnx
import pytest

import app.simulation
from app.domain.detection import COCO_BOAT, Detection, DetectionSettings
from app.simulation.harbour import make_harbour
from app.simulation.settings import HarbourSettings
from app.simulation.ship_plans import Fleet
from tools.train_harbour_detector.targets import boxes_of
from worker.inference.families.yolox import YoloxDetector
from worker.inference.session import OnnxSession, SessionSettings

MODEL = Path(app.simulation.__file__).with_name("harbour_yolox_nano.onnx")
UNSEEN_SEED = 4711  # training has 10000 and above
LEAST_RECALL, LEAST_PRECISION = 0.8, 0.7


@pytest.fixture(scope="module")
def detector() -> YoloxDetector:
    """Open the shipped file as the worker does, with the settings a user starts with."""
    session = OnnxSession(MODEL, SessionSettings(threads=1))
    return YoloxDetector(session, DetectionSettings())


def overlap(found: Detection, box: np.ndarray) -> float:
    """Intersection over union of a detection and a box x1 y1 x2 y2."""
    width = min(found.x2_px, box[2]) - max(found.x1_px, box[0])
    height = min(found.y2_px, box[3]) - max(found.y1_px, box[1])
    common = max(0.0, width) * max(0.0, height)
    area = (found.x2_px - found.x1_px) * (found.y2_px - found.y1_px)
    return float(common / (area + (box[2] - box[0]) * (box[3] - box[1]) - common))


def test_the_file_is_a_drop_in_for_the_published_yolox_nano(detector: YoloxDetector) -> None:
    """Input and output are those of the YOLOX project's exports, at a 4:3 input, in under 5 MB."""
    assert detector.signature == {
        "family": "yolox",
        "input": "'images' tensor(float) [1, 3, 480, 640]",
        "output": "'output' tensor(float) [1, 6300, 85]",
        "width_px": 640,
        "height_px": 480,
        "class_count": 80,
        "class_names": None,
    }
    assert MODEL.stat().st_size < 5_000_000


def test_the_file_says_that_it_was_made_from_rendered_scenes_only() -> None:
    """Nobody who finds the file alone takes it for a detector of photographs."""
    properties = {p.key: p.value for p in onnx.load(MODEL).metadata_props}
    assert "rendered scenes" in properties["trained_on"]
    card = MODEL.with_suffix(".md").read_text()
    assert "rendered scenes only" in card


def test_vessels_of_unseen_seeds_and_hulls_are_found(detector: YoloxDetector) -> None:
    """Of vessels that were never trained on, most are found, and most of what is found is real."""
    settings = HarbourSettings(fleet=Fleet.JUDGING)
    targets = hits = shown = 0
    for frame in make_harbour(UNSEEN_SEED, 8, 1280, 960, settings=settings).frames:
        seen = frame.observe()
        boxes = boxes_of(seen.truth, 1280)
        found = detector.detect(seen.image)
        assert {d.class_id for d in found} <= {COCO_BOAT}
        wanted = boxes[boxes[:, 4] > 0]
        targets += len(wanted)
        hits += sum(any(overlap(d, box) >= 0.5 for d in found) for box in wanted)
        ignored = boxes[boxes[:, 4] == 0]
        shown += sum(all(overlap(d, box) < 0.1 for box in ignored) for d in found)
    assert targets >= 16
    assert hits >= LEAST_RECALL * targets
    assert hits >= LEAST_PRECISION * shown
