"""Network output into detections, against a decoder written the plain way."""

from math import exp

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.detection import Detection, DetectionSettings
from app.domain.letterbox import Letterbox
from app.domain.yolox import cell_count, class_count, detections_of

LETTERBOX = Letterbox(320, 192, 160, 96)
CELLS = cell_count(160, 96)
ALL_STAY = DetectionSettings(nms_iou=1.0)


def quiet_output(classes: int = 80) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """Return an output in which no cell sees anything."""
    return np.zeros((CELLS, 5 + classes), dtype=np.float32)


def decoded_by_the_graph(
    output: np.ndarray[tuple[int, int], np.dtype[np.float32]],
) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """Return what a network exported with `decode_in_inference` would have given instead."""
    cells = [
        (column, row, stride)
        for stride in (8, 16, 32)
        for row in range(96 // stride)
        for column in range(160 // stride)
    ]
    rows = output.copy()
    for row, (x, y, stride) in zip(rows, cells, strict=True):
        row[:4] = [
            (row[0] + x) * stride,
            (row[1] + y) * stride,
            exp(row[2]) * stride,
            exp(row[3]) * stride,
        ]
    return rows


def naive(output: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> list[Detection]:
    """Decode cell by cell in the order of the output: all cells first, thresholds last."""
    found = []
    cell = 0
    for stride in (8, 16, 32):
        for row in range(96 // stride):
            for column in range(160 // stride):
                x, y, log_w, log_h, objectness, *classes = map(float, output[cell])
                cell += 1
                best = max(range(len(classes)), key=classes.__getitem__)
                score = float(np.float32(objectness) * np.float32(classes[best]))
                if best != 8 or score < 0.25:
                    continue
                centre_x, centre_y = (x + column) * stride, (y + row) * stride
                half_w, half_h = exp(log_w) * stride / 2, exp(log_h) * stride / 2
                x1, x2 = (min(max(v * 2, 0), 320) for v in (centre_x - half_w, centre_x + half_w))
                y1, y2 = (min(max(v * 2, 0), 192) for v in (centre_y - half_h, centre_y + half_h))
                if x2 > x1 and y2 > y1:
                    found.append(Detection(x1, y1, x2, y2, score))
    return sorted(found, key=lambda detection: -detection.score)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_decoding_equals_the_naive_way(seed: int) -> None:
    """Looking at scores first and decoding the rest gives the same boxes as decoding all."""
    random = np.random.default_rng(seed)
    output = quiet_output()
    output[:, :4] = random.normal(0, 1, (CELLS, 4))
    output[:, 4:] = random.uniform(0, 1, (CELLS, 81)) ** 2
    output[:, 5 + 8] **= 0.1  # boats are not rare
    expected = naive(output)
    ours = detections_of(output, LETTERBOX, ALL_STAY)
    assert [d.score for d in ours] == [d.score for d in expected]
    for mine, other in zip(ours, expected, strict=True):
        assert (mine.x1_px, mine.y1_px, mine.x2_px, mine.y2_px) == pytest.approx(
            (other.x1_px, other.y1_px, other.x2_px, other.y2_px)
        )


def test_one_boat_in_one_cell() -> None:
    """A cell of the second grid gives its box in full-image pixels, with score and class."""
    output = quiet_output()
    cell = (160 // 8) * (96 // 8) + 2 * (160 // 16) + 3  # stride 16, row 2, column 3
    output[cell, :5] = (0.5, 0.25, np.log(2), np.log(1), 0.9)
    output[cell, 5 + 8] = 0.8
    (found,) = detections_of(output, LETTERBOX, DetectionSettings())
    # Centre (56, 36), size 32 x 16 in the input, which shows the image at half its size.
    assert (found.x1_px, found.y1_px, found.x2_px, found.y2_px) == pytest.approx(
        (80, 56, 144, 88), abs=1e-5
    )
    assert (found.score, found.class_id) == (pytest.approx(0.72), 8)


def test_only_the_wanted_classes_count() -> None:
    """A lorry is no vessel unless lorries are asked for."""
    output = quiet_output()
    output[0, 4], output[0, 5 + 7], output[0, 5 + 8] = 1.0, 0.9, 0.5
    assert detections_of(output, LETTERBOX, DetectionSettings()) == []
    (found,) = detections_of(output, LETTERBOX, DetectionSettings(class_ids=(7, 8)))
    assert found.class_id == 7


def test_overlapping_boxes_become_one() -> None:
    """Neighbouring cells that see the same boat give the best of their boxes."""
    output = quiet_output()
    output[:2, 4] = (0.8, 0.9)
    output[0, 0] = 1.0  # the same place, seen from the cell to its left
    output[:2, 2:4] = 2.0
    output[:2, 5 + 8] = 1.0
    (found,) = detections_of(output, LETTERBOX, DetectionSettings())
    assert found.score == pytest.approx(0.9)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30])
def test_senseless_numbers_give_no_senseless_boxes(value: float) -> None:
    """A broken network's NaN or infinity neither fails nor hides a sound box."""
    output = quiet_output()
    output[:2, 4] = output[:2, 5 + 8] = 1.0
    output[0, :4] = value
    output[1, :4] = (5.0, 5.0, 1.0, 1.0)
    found = detections_of(output, LETTERBOX, DetectionSettings())
    boxes = [(d.x1_px, d.y1_px, d.x2_px, d.y2_px) for d in found]
    assert np.isfinite(boxes).all()
    assert any(box[2] - box[0] == pytest.approx(np.e * 16, rel=1e-3) for box in boxes)


def test_shapes_of_the_official_export() -> None:
    """416 x 416 pixels have 3,549 cells, and 85 columns tell 80 classes apart."""
    assert (cell_count(416, 416), class_count(85)) == (3549, 80)


@pytest.mark.parametrize("low", [-2.0, 0.0])
def test_a_graph_that_decodes_itself_gives_the_same_boxes(low: float) -> None:
    """Decoded rows are told from raw ones, though no raw number be negative either."""
    random = np.random.default_rng(3)
    output = quiet_output()
    output[:, :4] = random.uniform(low, 1, (CELLS, 4))
    output[:, [4, 5 + 8]] = random.uniform(0, 1, (CELLS, 2))
    raw = detections_of(output, LETTERBOX, ALL_STAY)
    decoded = detections_of(decoded_by_the_graph(output), LETTERBOX, ALL_STAY)
    assert len(raw) > 10
    for one, other, plain in zip(raw, decoded, naive(output), strict=True):
        assert one.edges_px == pytest.approx(other.edges_px, abs=1e-3)
        assert one.edges_px == pytest.approx(plain.edges_px)
