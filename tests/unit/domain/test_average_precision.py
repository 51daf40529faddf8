"""Average precision on small cases whose answer is known, and its interval."""

import numpy as np
import pytest

from app.domain.average_precision import (
    Detected,
    Outcome,
    Question,
    Size,
    TrueBoxes,
    outcomes,
    precision,
)
from app.domain.average_precision_interval import precision_intervals

BOX = [10.0, 10.0, 40.0, 40.0]
FAR = [300.0, 300.0, 40.0, 40.0]


def judged(
    boxes: list[list[float]],
    found: list[list[float]],
    *,
    crowd: tuple[int, ...] = (),
    ignored: tuple[int, ...] = (),
    images: int = 1,
) -> Outcome:
    """Match detections, the most certain first, with boxes, all of image 0."""
    places = np.array(boxes).reshape(-1, 4)
    number = np.arange(len(boxes))
    none = np.zeros(len(boxes), dtype=np.bool_)
    truth = TrueBoxes(
        np.zeros(len(boxes), dtype=np.intp),
        places,
        places[:, 2] * places[:, 3],
        np.isin(number, crowd),
        none,
    )
    scores = np.linspace(0.9, 0.1, len(found))
    detected = Detected(np.zeros(len(found), dtype=np.intp), np.array(found).reshape(-1, 4), scores)
    question = Question(~none, np.isin(number, ignored), Size.ALL)
    return outcomes(truth, detected, [question], images)[0]


def test_what_is_found_first_is_right_and_what_is_found_twice_is_wrong() -> None:
    """Two detections on one box, another box missed: half of the boxes, precision first 1."""
    outcome = judged([BOX, FAR], [BOX, BOX])
    assert outcome.is_right[:, 0].all()
    assert not outcome.is_right[:, 1].any()
    figures = precision(outcome)
    assert figures.boxes == 2
    assert figures.ar100 == 0.5
    assert figures.ap == pytest.approx(51 / 101)


def test_a_crowd_takes_any_number_and_an_ignored_box_one() -> None:
    """Detections on them are neither right nor wrong; a second one on an ignored box is wrong."""
    crowd = judged([BOX, FAR], [BOX, BOX, FAR], crowd=(0,))
    assert crowd.is_ignored[0].tolist() == [True, True, False]
    ignored = judged([BOX, FAR], [BOX, BOX, FAR], ignored=(0,))
    assert ignored.is_ignored[0].tolist() == [True, False, False]
    assert precision(crowd).ap == pytest.approx(1.0)
    assert precision(ignored).ap == pytest.approx(0.5)


def test_a_box_that_counts_goes_before_an_ignored_one_that_fits_better() -> None:
    """As in pycocotools: an ignored box is taken only where no other is left."""
    nearby = [10.0, 10.0, 44.0, 40.0]
    outcome = judged([nearby, BOX], [BOX], ignored=(1,))
    assert outcome.is_right[0].tolist() == [True]


def test_nothing_to_find_has_no_figures_and_nothing_found_has_zeros() -> None:
    """No box: no figure at all, not a 0; no detection: 0."""
    empty = judged([], [BOX])
    assert precision(empty).ap is None
    assert precision_intervals(empty) is None
    assert precision(judged([BOX], [])).ap == 0.0


def test_an_interval_is_the_same_every_time_and_a_point_where_all_images_are_alike() -> None:
    """All boxes in one of two images: what is drawn is that image, or nothing to be found."""
    intervals = precision_intervals(judged([BOX, FAR], [BOX], images=2))
    assert intervals is not None
    assert intervals.ar100 == (0.5, 0.5)
    assert intervals == precision_intervals(judged([BOX, FAR], [BOX], images=2))
    assert precision_intervals(judged([BOX, FAR], [BOX])) is None
