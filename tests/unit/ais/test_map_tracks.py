"""Thinning of tracks for the map, and what is doubtful of them."""

import math
from datetime import UTC, datetime
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from app.ais.thinning import LONGEST_STEP_S, METRES_PER_DEG, Fix, thinned
from app.ais.track_doubts import doubts_of
from app.domain.plausibility import Doubt

SILENCE_S = 600.0
START = datetime(2026, 1, 1, tzinfo=UTC)


def straight(count: int, step_s: float = 10.0, speed_deg_s: float = 5e-5) -> list[Fix]:
    """Return fixes of a vessel that goes north steadily."""
    return [
        Fix(at * step_s, 53.5 + at * step_s * speed_deg_s, 10.0, 10.0, 0.0, 0.0)
        for at in range(count)
    ]


def test_a_straight_track_is_a_few_points() -> None:
    """Ends stay, and one point every few minutes, so that steadiness is no silence."""
    kept = thinned(straight(100), 5.0, 0.6, SILENCE_S)
    assert (kept[0], kept[-1]) == (straight(100)[0], straight(100)[-1])
    assert len(kept) < 10
    assert max(b.time_s - a.time_s for a, b in pairwise(kept)) <= (LONGEST_STEP_S + 10)


def test_both_ends_of_a_silence_stay() -> None:
    """The gap is drawn where it was, not shorter and not longer."""
    fixes = [*straight(20), *[fix._replace(time_s=fix.time_s + 5000) for fix in straight(20)]]
    kept = thinned(fixes, 50.0, 0.6, SILENCE_S)
    assert fixes[19] in kept
    assert fixes[20] in kept


@given(
    st.lists(
        st.tuples(st.floats(1, 300), st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3)),
        min_size=1,
        max_size=60,
    ),
    st.floats(1, 200),
)
def test_no_fix_is_far_from_where_the_track_was_expected(
    steps: list[tuple[float, float, float]], tolerance_m: float
) -> None:
    """Every fix that is left out lies within the tolerance of the way of the points before it."""
    fixes, time_s, lat, lon = [Fix(0.0, 53.5, 10.0, None, None, None)], 0.0, 53.5, 10.0
    for step_s, north, east in steps:
        time_s, lat, lon = time_s + step_s, lat + north, lon + east
        fixes.append(Fix(time_s, lat, lon, None, None, None))
    across = math.cos(math.radians(53.5))
    kept = thinned(fixes, tolerance_m, across, SILENCE_S)
    assert kept == [fix for fix in fixes if fix in kept]
    for fix in fixes:
        if fix in kept:
            continue
        before = [each for each in kept if each.time_s < fix.time_s][-2:]
        last = before[-1]
        speed = (0.0, 0.0)
        if len(before) == 2:
            span_s = last.time_s - before[0].time_s
            speed = (
                (last.lat_deg - before[0].lat_deg) / span_s,
                (last.lon_deg - before[0].lon_deg) / span_s,
            )
        since_s = fix.time_s - last.time_s
        north = fix.lat_deg - last.lat_deg - speed[0] * since_s
        east = (fix.lon_deg - last.lon_deg - speed[1] * since_s) * across
        assert math.hypot(north, east) * METRES_PER_DEG <= tolerance_m * 1.001


def test_a_jump_is_found_and_a_calm_track_is_not_doubted() -> None:
    """One report far away is a jump; the same track without it is beyond doubt."""
    calm = straight(30)
    jumped = [*calm[:15], calm[15]._replace(lat_deg=54.5), *calm[16:]]
    assert doubts_of(211000001, calm, START) == []
    assert Doubt.JUMP in doubts_of(211000001, jumped, START)


def test_two_vessels_under_one_number_are_found() -> None:
    """Reports that take turns between two places are of two vessels."""
    turns = [
        fix._replace(lat_deg=fix.lat_deg + (0.5 if at % 2 else 0.0))
        for at, fix in enumerate(straight(30))
    ]
    assert Doubt.TWO_PLACES in doubts_of(211000001, turns, START)


def test_a_few_late_reports_are_no_doubt_of_a_vessel() -> None:
    """Every receiver has late reports: only a clock that is mostly wrong is worth a word."""
    calm = straight(30)
    late = [fix._replace(source="doubtful") if at % 5 == 0 else fix for at, fix in enumerate(calm)]
    wrong = [fix._replace(source="doubtful") if at % 5 else fix for at, fix in enumerate(calm)]
    assert doubts_of(211000001, late, START) == []
    assert doubts_of(211000001, wrong, START) == [Doubt.DOUBTFUL_TIME]
    assert doubts_of(211000001, wrong[1:3], START) == []
