"""A ship that goes straight on, turns and goes straight on is found on its way."""

from math import cos, hypot, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.track_bends import Vector, round_a_bend


def place(legs_m: Vector, radius_m: float, turn: float, gone_m: float) -> Vector:
    """Return where a ship is that goes north, along an arc (positive to port) and on."""
    side, arc_m = (1 if turn > 0 else -1), radius_m * abs(turn)
    angle = min(max(0.0, gone_m - legs_m[0]), arc_m) / radius_m
    beyond_m = max(0.0, gone_m - legs_m[0] - arc_m)
    north_m = min(gone_m, legs_m[0]) + radius_m * sin(angle) + beyond_m * cos(turn)
    return -side * radius_m * (1 - cos(angle)) - beyond_m * sin(turn), north_m


@given(
    st.floats(20, 600),
    st.floats(20, 600),
    st.floats(30, 300),
    st.floats(0.4, 2.5),
    st.sampled_from([-1, 1]),
    st.floats(0, 1),
)
def test_a_bend_is_found_from_its_ends(
    before_m: float, after_m: float, radius_m: float, turn: float, side: int, share: float
) -> None:
    """Places, courses and a steady speed at both ends tell the whole way to a centimetre."""
    legs_m, turn, speed_mps = (before_m, after_m), turn * side, 5.0
    whole_m = before_m + radius_m * abs(turn) + after_m
    chord_m = place(legs_m, radius_m, turn, whole_m)
    velocities = (0.0, speed_mps), (-speed_mps * sin(turn), speed_mps * cos(turn))
    span_s = whole_m / speed_mps
    found = round_a_bend(chord_m, *velocities, span_s, share * span_s)
    assert found is not None
    true = place(legs_m, radius_m, turn, share * whole_m)
    assert hypot(found[0] - true[0], found[1] - true[1]) < 0.01


@pytest.mark.parametrize(
    ("chord_m", "end_mps"),
    [
        ((0.0, 500.0), (0.0, 5.0)),  # straight on
        ((300.0, 300.0), (-5.0, 0.0)),  # the legs do not meet
        ((300.0, 300.0), (0.5, 0.0)),  # hardly any way
        ((30.0, 30.0), (5.0, 0.0)),  # much shorter than the speeds say
    ],
)
def test_what_is_no_bend_is_left_to_others(chord_m: Vector, end_mps: Vector) -> None:
    """Only what two straight legs and an arc explain is taken for a bend."""
    assert round_a_bend(chord_m, (0.0, 5.0), end_mps, 110.0, 50.0) is None
