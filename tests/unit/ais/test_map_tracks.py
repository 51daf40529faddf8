"""Thinning of tracks for the map, what is doubtful of them, and how they are told."""

import math
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from app.ais.map_answer import as_json
from app.ais.map_schemas import StretchOut
from app.ais.map_tracks import Stretch
from app.ais.moving_fixes import UNKNOWN, MovingFixes
from app.ais.thinning import LONGEST_STEP_S, METRES_PER_DEG, thinned
from app.ais.track_doubts import doubts_of
from app.domain.ais import FixTimeSource
from app.domain.ais_bulk import AIS_CLASSES, SOURCES
from app.domain.plausibility import Doubt
from app.identities.shown import Shown

SILENCE_S = 600.0
START = datetime(2026, 1, 1, tzinfo=UTC)
MMSI, OTHER = 211_000_001, 211_000_002
LATE = SOURCES.index(FixTimeSource.DOUBTFUL)


class Fix(NamedTuple):
    """A row of the map's columns."""

    mmsi: int
    time_s: float
    lat_deg: float
    lon_deg: float = 10.0
    sog_kn: float = 10.0
    cog_deg: float = 0.0
    heading_deg: float = 0.0
    source: int = SOURCES.index(FixTimeSource.PROMPT)
    ais_class: int = 0


def straight(count: int, step_s: float = 10.0, speed_deg_s: float = 5e-5) -> list[Fix]:
    """Return fixes of a vessel that goes north steadily."""
    return [Fix(MMSI, at * step_s, 53.5 + at * step_s * speed_deg_s) for at in range(count)]


def kept_of(fixes: Sequence[Fix], tolerance_m: float) -> list[Fix]:
    """Thin a vessel's fixes."""
    _, time_s, lat_deg, lon_deg, *_ = zip(*fixes, strict=True)
    return [fixes[at] for at in thinned(time_s, lat_deg, lon_deg, tolerance_m, SILENCE_S)]


def doubted(fixes: Sequence[Fix]) -> list[Doubt]:
    """Return what is doubtful of a vessel."""
    return doubts_of(MovingFixes.of(fixes, 0.0), START).get(MMSI, [])


def test_a_straight_track_is_a_few_points() -> None:
    """Ends stay, and one point every few minutes, so that steadiness is no silence."""
    kept = kept_of(straight(100), 5.0)
    assert (kept[0], kept[-1]) == (straight(100)[0], straight(100)[-1])
    assert len(kept) < 10
    assert max(b.time_s - a.time_s for a, b in pairwise(kept)) <= (LONGEST_STEP_S + 10)


def test_both_ends_of_a_silence_stay() -> None:
    """The gap is drawn where it was, not shorter and not longer."""
    fixes = [*straight(20), *[fix._replace(time_s=fix.time_s + 5000) for fix in straight(20)]]
    kept = kept_of(fixes, 50.0)
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
    fixes, time_s, lat, lon = [Fix(MMSI, 0.0, 53.5)], 0.0, 53.5, 10.0
    for step_s, north, east in steps:
        time_s, lat, lon = time_s + step_s, lat + north, lon + east
        fixes.append(Fix(MMSI, time_s, lat, lon))
    across = math.cos(math.radians(53.5))
    kept = kept_of(fixes, tolerance_m)
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
    assert doubted(calm) == []
    assert Doubt.JUMP in doubted(jumped)


def test_two_vessels_under_one_number_are_found() -> None:
    """Reports that take turns between two places are of two vessels."""
    turns = [
        fix._replace(lat_deg=fix.lat_deg + (0.5 if at % 2 else 0.0))
        for at, fix in enumerate(straight(30))
    ]
    assert Doubt.TWO_PLACES in doubted(turns)


def test_a_few_late_reports_are_no_doubt_of_a_vessel() -> None:
    """Every receiver has late reports: only a clock that is mostly wrong is worth a word."""
    calm = straight(30)
    late = [fix._replace(source=LATE) if at % 5 == 0 else fix for at, fix in enumerate(calm)]
    wrong = [fix._replace(source=LATE) if at % 5 else fix for at, fix in enumerate(calm)]
    assert doubted(late) == []
    assert doubted(wrong) == [Doubt.DOUBTFUL_TIME]
    assert doubted(wrong[1:3]) == []


def test_the_answer_is_what_the_schema_says() -> None:
    """Steps add up to the points again; each vessel has its own, its last class and its doubts."""
    fixes = [
        Fix(OTHER, 1.0, 53.0, 9.0, UNKNOWN, UNKNOWN, UNKNOWN, ais_class=AIS_CLASSES.index("B")),
        *straight(3),
        Fix(OTHER, 1.0, 53.0, 9.0),  # the same fix from another file
        Fix(OTHER, 4.0, 53.1, 9.0, 80.0, 359.6),
    ]
    columns = MovingFixes.of(fixes, 0.0).once()
    found = Stretch(
        START, START + timedelta(hours=1), START, 8.0, columns, {}, doubts_of(columns, START)
    )
    first, second = StretchOut.model_validate_json(as_json(found, Shown())).vessels
    assert (first.mmsi, first.t, first.lat) == (MMSI, [0, 10, 10], [5_350_000, 50, 50])
    assert (second.t, second.lat, second.lon) == ([1, 3], [5_300_000, 10_000], [900_000, 0])
    assert (second.sog, second.cog, second.heading) == ([-1, 800], [-1, 360], [-1, 0])
    assert (first.ais_class, second.ais_class) == (None, "B")
    assert (first.flags, second.flags) == ([], ["jump", "impossible_speed"])
    empty = MovingFixes.of([], 0.0).once()
    nothing = Stretch(START, START, START, 8.0, empty, {}, doubts_of(empty, START))
    assert StretchOut.model_validate_json(as_json(nothing, Shown())).vessels == []
