"""Non-maximum suppression against OpenCV's."""

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from app.domain.suppression import suppress

whole_boxes = st.lists(
    st.tuples(st.integers(0, 50), st.integers(0, 50), st.integers(1, 30), st.integers(1, 30)),
    max_size=30,
)


@given(whole_boxes, st.sampled_from([0.317, 0.4511, 0.62]), st.randoms(use_true_random=False))
def test_the_same_boxes_stay_as_with_opencv(
    boxes: list[tuple[int, int, int, int]], iou_limit: float, random: object
) -> None:
    """For any boxes with different scores the same ones stay, in the same order."""
    assert hasattr(random, "sample")
    scores = np.array(random.sample(range(1, 1000), len(boxes)), dtype=np.float64) / 1000
    ours = np.array([[x, y, x + w, y + h] for x, y, w, h in boxes], np.float64).reshape(-1, 4)
    theirs = cv2.dnn.NMSBoxes([list(box) for box in boxes], scores.tolist(), 0.0, iou_limit)
    assert suppress(ours, scores, iou_limit).tolist() == [int(index) for index in theirs]


def test_boxes_apart_all_stay_by_score() -> None:
    """Boxes that do not touch stay, the best first."""
    boxes = np.array([[0, 0, 1, 1], [2, 2, 3, 3], [4, 4, 5, 5]], np.float64)
    assert suppress(boxes, np.array([0.2, 0.9, 0.5]), 0.45).tolist() == [1, 2, 0]


def test_nothing_in_nothing_out() -> None:
    """No boxes are no problem."""
    assert suppress(np.empty((0, 4)), np.empty(0), 0.45).tolist() == []
