"""What a JSON column's text becomes when it is read."""

import json

from hypothesis import given
from hypothesis import strategies as st

from app.db import from_json_text

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


def test_half_a_surrogate_pair_is_read_too() -> None:
    """Old rows may hold what the fast reader takes for no text."""
    assert from_json_text(r'{"name": "\ud83d"}') == {"name": "\ud83d"}
