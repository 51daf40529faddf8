"""Detection for real: the published weights on the published photographs."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from app.domain.detection import Detection, DetectionSettings
from tests.factories.onnx_models import yolox_like
from worker.inference.detector import Detector
from worker.inference.families import open_detector
from worker.inference.image import decode_image, decode_photograph
from worker.inference.pool import threads_for
from worker.inference.session import ModelRefusedError, SessionSettings

ONE_THREAD = SessionSettings(threads=1)


@pytest.fixture(scope="module")
def nano(shared_dir: Path) -> Detector:
    """YOLOX-Nano with COCO weights."""
    path = shared_dir / "models/yolox_nano.onnx"
    return open_detector(path, "yolox", DetectionSettings(), ONE_THREAD)


def overlap(detection: Detection, box: list[float]) -> float:
    """Intersection over union of a detection and a box x1 y1 x2 y2."""
    width = min(detection.x2_px, box[2]) - max(detection.x1_px, box[0])
    height = min(detection.y2_px, box[3]) - max(detection.y1_px, box[1])
    shared = max(width, 0) * max(height, 0)
    area = (detection.x2_px - detection.x1_px) * (detection.y2_px - detection.y1_px)
    return shared / (area + (box[2] - box[0]) * (box[3] - box[1]) - shared)


def test_every_published_photograph_has_a_boat(shared_dir: Path, nano: Detector) -> None:
    """In each of the four photographs at least one boat is seen, within the image."""
    photographs = sorted((shared_dir / "real/bonk").glob("*/*.jpg"))
    assert len(photographs) == 4
    for path in photographs:
        found = nano.detect(decode_image(path.read_bytes()))
        assert found, path.name
        assert [d.score for d in found] == sorted((d.score for d in found), reverse=True)
        for detection in found:
            assert detection.class_id == 8
            assert 0 <= detection.x1_px < detection.x2_px <= 2560
            assert 0 <= detection.y1_px < detection.y2_px <= 1920


def test_the_published_vessel_is_found(shared_dir: Path, nano: Detector) -> None:
    """The best boat is the labelled vessel, as the paper's detector and a person boxed it."""
    folder = shared_dir / "real/bonk"
    label = json.loads((folder / "label/00139255c1d7dd9c.json").read_text())
    best = nano.detect(decode_image((folder / "image/00139255c1d7dd9c.jpg").read_bytes()))[0]
    # The paper's much larger network includes the mast, so its box is higher by half.
    assert overlap(best, label["objects"][0]["bbImage2d"]) > 0.45
    x, y, width, height = label["2d_annotation_gt"][0]["bbox"]
    assert overlap(best, [x, y, x + width, y + height]) > 0.7


def test_the_session_is_run_as_configured(shared_dir: Path, nano: Detector) -> None:
    """The number of threads does not change what is seen."""
    path = shared_dir / "models/yolox_nano.onnx"
    image = decode_image((shared_dir / "real/bonk/image/00139255c1d7dd9c.jpg").read_bytes())
    two = open_detector(path, "yolox", DetectionSettings(), SessionSettings(threads=2))
    ours, theirs = nano.detect(image), two.detect(image)
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        assert one.score == pytest.approx(other.score, abs=1e-3)


def test_the_published_vessel_is_found_in_a_smaller_photograph(shared_dir: Path) -> None:
    """Decoded at half its sides, boxes are still in the pixels of the whole photograph."""
    settings = DetectionSettings(decoding_divisor=2)
    detector = open_detector(shared_dir / "models/yolox_nano.onnx", "yolox", settings, ONE_THREAD)
    data = (shared_dir / "real/bonk/image/00139255c1d7dd9c.jpg").read_bytes()
    seen = decode_photograph(data, detector.decoding_divisor)
    assert seen.pixels_bgr.shape == (960, 1280, 3)
    best = detector.detect(seen.pixels_bgr, (seen.width_px, seen.height_px))[0]
    label = json.loads((shared_dir / "real/bonk/label/00139255c1d7dd9c.json").read_text())
    x, y, width, height = label["2d_annotation_gt"][0]["bbox"]
    assert overlap(best, [x, y, x + width, y + height]) > 0.7


def test_a_small_model_leaves_a_core_to_the_decoder(monkeypatch: pytest.MonkeyPatch) -> None:
    """On four cores a small one gets three, a large one all; on one core both get it."""
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert [threads_for(size) for size in (4_000_000, 400_000_000)] == [3, 4]
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    assert [threads_for(size) for size in (4_000_000, 400_000_000)] == [1, 1]


def test_a_missing_provider_is_an_error(shared_dir: Path) -> None:
    """A provider that is not installed is refused by name, never replaced in silence."""
    settings = SessionSettings(providers=("TPUExecutionProvider", "CPUExecutionProvider"))
    with pytest.raises(ModelRefusedError, match="TPUExecutionProvider"):
        open_detector(shared_dir / "models/yolox_nano.onnx", "yolox", DetectionSettings(), settings)


def open_bytes(tmp_path: Path, data: bytes, class_ids: tuple[int, ...] = (8,)) -> Detector:
    """Open model bytes as a YOLOX detector."""
    path = tmp_path / "model.onnx"
    path.write_bytes(data)
    return open_detector(path, "yolox", DetectionSettings(class_ids=class_ids), ONE_THREAD)


def test_any_input_size_and_named_classes_are_understood(tmp_path: Path) -> None:
    """A model of another size with its own named classes works like the official ones."""
    detector = open_bytes(
        tmp_path, yolox_like((1, 3, 64, 96), (1, 126, 7), class_names=["tug", "ferry"]), (1,)
    )
    assert detector.signature["class_names"] == ("tug", "ferry")
    (found,) = detector.detect(np.zeros((128, 192, 3), np.uint8))
    assert found.class_id == 1
    assert found.score == pytest.approx(0.81)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (yolox_like(input_shape=(1, 3, "height", "width")), r"expected is one float32 input"),
        (yolox_like(input_shape=(2, 3, 64, 64)), r"\[2, 3, 64, 64\].*expected"),
        (yolox_like(input_shape=(1, 1, 64, 64)), r"\[1, 1, 64, 64\].*expected"),
        (yolox_like(input_shape=(1, 3, 60, 60)), r"multiples of 32"),
        (yolox_like(input_type=2), r"tensor\(uint8\).*float32"),
        (yolox_like(output_shape=(1, 100, 85)), r"\[1, 100, 85\].*\[1, 84, 5 \+ classes\]"),
        (yolox_like(output_shape=(1, 85, 84)), r"\[1, 85, 84\].*expected"),
        (yolox_like(output_shape=(1, 84, 5)), r"\[1, 84, 5\].*expected"),
        (yolox_like(output_shape=(84, 85)), r"\[84, 85\].*expected"),
        (yolox_like(output_shape=(1, 84, 7)), r"2 classes.*class_names"),
        (yolox_like(output_shape=(1, 84, 7), class_names=["tug"]), r"list of 2 names"),
        (yolox_like(output_shape=(1, 84, 7), class_names=["a", "b"]), r"class 8 does not exist"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    """A model with another signature is refused with what was found and what is expected."""
    with pytest.raises(ModelRefusedError, match=message):
        open_bytes(tmp_path, data)


def test_an_unknown_family_is_refused(tmp_path: Path) -> None:
    """A family that does not exist is refused with those that do."""
    with pytest.raises(ModelRefusedError, match=r"'yolo9'.*yolox"):
        open_detector(tmp_path / "x", "yolo9", DetectionSettings(), ONE_THREAD)


def test_what_is_not_a_model_is_refused_without_its_place(tmp_path: Path) -> None:
    """A broken graph is refused, and the message does not tell where the server keeps files."""
    data = yolox_like().replace(b"ReduceSum", b"ReduceSux")
    with pytest.raises(ModelRefusedError, match="ReduceSux") as refused:
        open_bytes(tmp_path, data)
    assert str(tmp_path) not in str(refused.value)
