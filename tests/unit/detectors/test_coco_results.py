"""Results as other programs write them: ids that became floats, scores a rounding beyond 1."""

import json
from typing import Any

import pytest

from app.detectors.coco_results import read_results
from app.errors import Invalid


def test_ids_that_became_floats_are_ids() -> None:
    """A table with gaps writes 7.0 for 7; a softmax in single precision ends a little beyond 1."""
    row = {"image_id": 7.0, "category_id": 9.0, "bbox": [1, 2.5, 3e1, 4], "score": 1.0000001}
    (box,) = read_results(json.dumps([row]).encode()).boxes
    assert (box.image, box.class_id, box.score) == (7, 8, 1.0)
    assert (box.x1_px, box.y1_px, box.x2_px, box.y2_px) == (1, 2.5, 31, 6.5)


@pytest.mark.parametrize(
    ("changed", "field", "fix"),
    [
        ({"image_id": 7.5}, "[0].image_id", "whole number"),
        ({"image_id": float("nan")}, "[0].image_id", "whole number"),
        ({"category_id": "9"}, "[0].category_id", "without quotes"),
        ({"score": 1.001}, "[0].score", "between 0 and 1"),
        ({"score": float("inf")}, "[0].score", "between 0 and 1"),
        ({"bbox": [1, 2, -0.5, 4]}, "[0].bbox", "not two corners"),
    ],
)
def test_what_is_no_number_is_named(changed: dict[str, Any], field: str, fix: str) -> None:
    """The entry, the field and what would be right."""
    row = {"image_id": 7, "category_id": 9, "bbox": [1, 2, 3, 4], "score": 0.5} | changed
    with pytest.raises(Invalid) as refused:
        read_results(json.dumps([row]).encode())
    (problem,) = refused.value.fields
    assert problem.field == field
    assert fix in problem.message
