"""From fusion's arrays to columns: what JSON and databases can hold, whatever was computed."""

import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from app.db import json_text
from worker.tasks.pose_rows import pixels


@given(hnp.arrays(np.float64, st.tuples(st.integers(0, 9), st.just(2))))
def test_pixels_are_numbers_or_nothing(points: np.ndarray) -> None:
    """A point that is not finite in both coordinates is None; all others are kept exactly."""
    shown = pixels(points)
    assert len(shown) == len(points)
    for point, kept in zip(points, shown, strict=True):
        assert kept == (point.tolist() if np.isfinite(point).all() else None)
    assert json.loads(json_text(shown)) == shown
