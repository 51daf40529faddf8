"""What a JSON column's text is, and what it becomes when it is read."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.db import from_json_text, json_text

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**80), 2**80)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


@given(VALUES)
def test_json_is_read_as_it_was_written(value: object) -> None:
    """Every number to its last digit, every text with every letter."""
    assert from_json_text(json.dumps(value)) == value
    assert json.loads(json_text(value)) == value


def test_what_json_has_not_is_refused() -> None:
    """A number that is none is not stored; a text that reads like one is."""
    for number in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="not JSON compliant"):
            json_text({"points": [[1.0, number]]})
    for text in ("NaN", "Infinity", "\ud83d"):
        assert from_json_text(json_text([text])) == [text]


def test_half_a_surrogate_pair_is_read_too() -> None:
    """Old rows may hold what the fast reader takes for no text."""
    assert from_json_text(r'{"name": "\ud83d"}') == {"name": "\ud83d"}
