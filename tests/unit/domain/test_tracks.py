"""Where a vessel was at the moment of an image."""

import gzip
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from math import cos, hypot, radians, sin
from pathlib import Path
from statistics import median

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.ais import FixTimeSource, PositionReport, StaticReport
from app.domain.local_metres import moved, offset_m
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.track_headings import REPORTED_SIGMA_DEG
from app.domain.track_places import turn_deg
from app.domain.tracks import MPS_PER_KN, NoState, TrackMethod, TrackSettings, state_at
from app.domain.vessel_state import HeadingSource, StateFlag, VesselState

NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)
STATICS = [StaticReport(211_000_001, NOON, None, None, None, None, 8.0, 11.0, 4.0, 3.0)]
REPORT = PositionReport(
    211_000_001, NOON, NOON, 53.54, 9.98, 9.7, 100.0, 112.0, 0.0, 1, "A", True, report_id=7
)
PAPER = TrackSettings()
COURSE = TrackSettings(TrackMethod.COG_DR)
HERMITE = TrackSettings(TrackMethod.HERMITE)
TURNING = TrackSettings(TrackMethod.CTRV_DAMPED)


def after(seconds: float, **changes: object) -> PositionReport:
    """Return a report of the same vessel some seconds after noon."""
    moment = NOON + timedelta(seconds=seconds)
    changed = replace(REPORT, fix_time=moment, received_at=moment, report_id=8)
    return replace(changed, **changes)  # type: ignore[arg-type]


def state(
    reports: list[PositionReport], at_s: float, settings: TrackSettings = PAPER
) -> VesselState:
    """Return the state some seconds after noon, which must exist."""
    found = state_at(reports, STATICS, NOON + timedelta(seconds=at_s), settings)
    assert isinstance(found, VesselState)
    return found


def reason(reports: list[PositionReport], at_s: float, settings: TrackSettings = PAPER) -> NoState:
    """Return why there is no state some seconds after noon."""
    found = state_at(reports, STATICS, NOON + timedelta(seconds=at_s), settings)
    assert isinstance(found, NoState)
    return found


def test_paper_leaves_the_dead_reckoning_to_fusion() -> None:
    """The paper's state is the report itself with its age, heading and size."""
    found = state([after(-30), REPORT, after(5)], 1.5)
    assert found == VesselState(
        "211000001",
        53.54,
        9.98,
        112.0,
        9.7,
        1.5,
        8.0,
        11.0,
        4.0,
        3.0,
        HeadingSource.REPORTED,
        (7,),
        found.position_covariance_m2,
        heading_sigma_deg=REPORTED_SIGMA_DEG,
        track_method=TrackMethod.HEADING_DR,
    )


@pytest.mark.parametrize(
    ("reports", "at_s", "expected"),
    [
        ([], 0, NoState.NO_REPORT),
        ([after(1)], 0, NoState.NO_REPORT),
        ([REPORT], 60.001, NoState.TOO_OLD),
        ([replace(REPORT, heading_deg=None)], 1, NoState.NO_HEADING),
        ([replace(REPORT, sog_kn=None)], 1, NoState.NO_SPEED),
    ],
)
def test_reasons_for_no_state(
    reports: list[PositionReport], at_s: float, expected: NoState
) -> None:
    """A vessel that the paper's method cannot place gets the reason."""
    assert reason(reports, at_s) is expected


def test_a_vessel_of_unknown_size_is_a_place() -> None:
    """Without dimensions a vessel still takes part in the matching, by its place alone."""
    found = state_at([REPORT], [], NOON, PAPER)
    assert isinstance(found, VesselState)
    assert (found.length_m, found.width_m, found.flags) == (0.0, 0.0, (StateFlag.NO_SIZE,))


def test_reports_of_two_vessels_are_refused() -> None:
    """A state is one vessel's: mixing two is a mistake of the caller's."""
    with pytest.raises(ValueError, match="MMSI"):
        state_at([REPORT, replace(REPORT, mmsi=211_000_002)], STATICS, NOON, PAPER)


@given(course=st.floats(0, 359.9), knots=st.floats(0, 40), age_s=st.floats(0, 60))
def test_along_the_course(course: float, knots: float, age_s: float) -> None:
    """`cog_dr` moves the report by speed times age along the course, and holds the heading."""
    found = state([replace(REPORT, cog_deg=course, sog_kn=knots)], age_s, COURSE)
    way_m = knots * 1852 / 3600 * age_s
    expected = (way_m * sin(radians(course)), way_m * cos(radians(course)))
    moved_m = offset_m(53.54, 9.98, found.lat_deg, found.lon_deg)
    # A datetime holds whole microseconds, in which a fast ship covers 20 micrometres.
    assert moved_m == pytest.approx(expected, abs=1e-4)
    assert (found.age_s, found.heading_deg) == (0.0, 112.0)


@given(turn=st.floats(-3, 3), share=st.floats(0, 1))
def test_hermite_follows_a_turning_vessel(turn: float, share: float) -> None:
    """Between two reports 10 s apart a vessel on a circle is found to a decimetre."""
    speed_mps = 5.0
    rate = radians(turn)

    def report(seconds: float) -> PositionReport:
        course = rate * seconds
        if abs(rate) < 1e-9:
            east_m, north_m = 0.0, speed_mps * seconds
        else:
            east_m = speed_mps / rate * (1 - cos(course))
            north_m = speed_mps / rate * sin(course)
        lat_deg, lon_deg = moved(53.54, 9.98, east_m, north_m)
        course_deg = (turn * seconds) % 360
        return after(
            seconds,
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            cog_deg=course_deg,
            heading_deg=course_deg,
            sog_kn=speed_mps / MPS_PER_KN,
        )

    truth = report(10 * share)
    found = state([report(0), report(10)], 10 * share, HERMITE)
    error_m = hypot(*offset_m(truth.lat_deg, truth.lon_deg, found.lat_deg, found.lon_deg))
    assert error_m < 0.1
    assert truth.heading_deg is not None
    assert abs((found.heading_deg - truth.heading_deg + 180) % 360 - 180) < 1e-3


def test_hermite_meets_both_reports_and_names_them() -> None:
    """At the reports' own moments the curve passes through them; both are recorded as used."""
    first, last = REPORT, after(10, lat_deg=53.541, heading_deg=120.0)
    at_first, at_last = state([last, first], 0, HERMITE), state([first, last], 9.999999, HERMITE)
    assert (at_first.lat_deg, at_first.heading_deg) == (pytest.approx(53.54), 112.0)
    assert (at_last.lat_deg, at_last.heading_deg) == (
        pytest.approx(53.541),
        pytest.approx(120.0, abs=1e-5),
    )
    assert at_first.report_ids == (7, 8)


def test_the_sigmas_tell_where_a_state_came_from() -> None:
    """Age, the accuracy flag, a course for a heading and an unknown antenna widen them."""
    still = replace(REPORT, sog_kn=0.0)
    assert state([still], 0, COURSE).position_sigma_m == pytest.approx(5.0)
    assert state([replace(still, high_accuracy=False)], 0, COURSE).position_sigma_m == 10.0
    fresh, old = state([REPORT], 0, COURSE), state([REPORT], 40, COURSE)
    assert fresh.position_sigma_m < old.position_sigma_m
    bridged = state([REPORT, after(80)], 40, HERMITE)
    assert bridged.position_sigma_m < old.position_sigma_m
    by_course = state([replace(REPORT, heading_deg=None)], 0, COURSE)
    assert by_course.heading_sigma_deg > fresh.heading_sigma_deg


@given(course=st.floats(0, 359.9), length_m=st.floats(1, 200), width_m=st.floats(1, 30))
def test_the_covariance_is_told_along_the_axes_that_errors_have(
    course: float, length_m: float, width_m: float
) -> None:
    """An unsure moment spreads the place along the course, an unknown antenna along the hull."""
    unsure = replace(
        REPORT, cog_deg=course, heading_deg=course, fix_time_source=FixTimeSource.RECEIVED
    )
    statics = [
        replace(
            STATICS[0], to_bow_m=0.0, to_stern_m=length_m, to_port_m=0.0, to_starboard_m=width_m
        )
    ]
    found = state_at([unsure], statics, NOON, COURSE)
    assert isinstance(found, VesselState)
    east, east_north, north = found.position_covariance_m2
    u, v = sin(radians(course)), cos(radians(course))
    along = u * u * east + 2 * u * v * east_north + v * v * north
    across = v * v * east - 2 * u * v * east_north + u * u * north
    way_m = 2 * 9.7 * MPS_PER_KN  # in two seconds
    assert along == pytest.approx(25 + way_m**2 + (length_m / 2) ** 2)
    assert across == pytest.approx(25 + (width_m / 2) ** 2)


@given(turn=st.floats(-2, 2))
def test_a_damped_turn_goes_on_for_a_while(turn: float) -> None:
    """`ctrv_damped` turns on as the last two headings did, by at most 20 s of it."""
    reports = [after(-10, heading_deg=(112 - 10 * turn) % 360), REPORT]
    soon, late = state(reports, 1, TURNING), state(reports, 60, TURNING)
    assert turn_deg(112, soon.heading_deg) == pytest.approx(turn, rel=0.03, abs=1e-6)
    assert turn_deg(112, late.heading_deg) == pytest.approx(19 * turn, rel=0.01, abs=1e-6)
    way_m = offset_m(53.54, 9.98, late.lat_deg, late.lon_deg)
    aside_m = way_m[0] * cos(radians(100)) - way_m[1] * sin(radians(100))
    assert aside_m == pytest.approx(0, abs=1e-6) or (aside_m > 0) == (turn > 0)
    assert hypot(*way_m) <= 9.7 * MPS_PER_KN * 60 + 1e-4


def test_a_creeping_vessel_heads_where_its_places_lead() -> None:
    """Too slow for its course, a vessel without a heading heads along its track, flagged."""
    slow = {"sog_kn": 2.0, "heading_deg": None, "cog_deg": None}
    reports = [after(-20, **slow), after(20, lat_deg=53.5404, **slow)]
    found = state(reports, 0, HERMITE)
    assert found.heading_source is HeadingSource.TRACK
    assert found.heading_deg == pytest.approx(0.0, abs=1e-9)
    assert found.flags == (StateFlag.HEADING_NOT_REPORTED,)
    assert reason([after(-20, **slow), after(20, **slow)], 0, HERMITE) is NoState.NO_HEADING


def test_an_unsteady_vessel_is_foretold_less_surely() -> None:
    """A vessel that did not go where its course led is spread wider than one that did."""
    steady = [after(-30 + 10 * step, sog_kn=0.0) for step in range(4)]
    wandering = [
        replace(report, lat_deg=53.54 + 0.0005 * (step % 2)) for step, report in enumerate(steady)
    ]
    for settings in (PAPER, COURSE, TURNING):
        sure, unsure = state(steady, 30, settings), state(wandering, 30, settings)
        assert unsure.position_sigma_m > 2 * sure.position_sigma_m


def test_a_late_report_counts_only_where_nothing_else_is_known() -> None:
    """Nobody knows of when its place is, unless all of a vessel's reports are such."""
    late = after(8, fix_time_source=FixTimeSource.DOUBTFUL, lat_deg=53.55, report_id=9)
    assert state([after(-10), REPORT, late], 9.0).report_ids == (7,)
    assert state([after(-70), REPORT, late], 65.0).report_ids == (9,)
    lagging = [replace(REPORT, fix_time_source=FixTimeSource.DOUBTFUL), late]
    found = state(lagging, 9.0)
    assert found.report_ids == (9,)
    assert "doubtful_time" in found.flags


def test_hermite_without_a_later_report_goes_along_the_course() -> None:
    """With nothing after the image, or too far after it, the course carries the vessel on."""
    expected = state([REPORT], 10, COURSE)
    assert state([REPORT], 10, HERMITE) == expected
    assert state([REPORT, after(1000)], 10, HERMITE) == expected


def test_heading_turns_the_short_way() -> None:
    """Between 350 and 10 degrees lies north, not south."""
    reports = [replace(REPORT, heading_deg=350.0), after(10, heading_deg=10.0)]
    assert state(reports, 5, HERMITE).heading_deg == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("reports", "heading", "source"),
    [
        ([replace(REPORT, heading_deg=None)], 100.0, HeadingSource.COURSE),
        ([replace(REPORT, heading_deg=None, sog_kn=3.0)], 100.0, HeadingSource.COURSE),
        (
            [after(-200, sog_kn=0.1), after(-1, sog_kn=0.2, heading_deg=None)],
            112.0,
            HeadingSource.HELD,
        ),
    ],
)
def test_substitutes_for_a_heading(
    reports: list[PositionReport], heading: float, source: HeadingSource
) -> None:
    """A moving vessel heads where it goes, a still one where it last did; the source is told."""
    found = state(reports, 1, COURSE)
    assert (found.heading_deg, found.heading_source) == (heading, source)


@pytest.mark.parametrize(
    "reports",
    [
        [replace(REPORT, heading_deg=None, sog_kn=2.0)],
        [replace(REPORT, heading_deg=None, sog_kn=0.1)],
        [after(-700, sog_kn=0.1), after(-1, sog_kn=0.1, heading_deg=None)],
        [after(-20, sog_kn=6.0), after(-1, sog_kn=0.1, heading_deg=None)],
    ],
)
def test_no_substitute_where_there_is_none(reports: list[PositionReport]) -> None:
    """A drifting vessel, or one that moved since its last heading, has none."""
    assert reason(reports, 1, COURSE) is NoState.NO_HEADING


def test_a_still_vessel_needs_no_course() -> None:
    """Speed 0 without a course is no movement, not a missing one."""
    found = state([replace(REPORT, sog_kn=0.0, cog_deg=None)], 30, COURSE)
    assert (found.lat_deg, found.lon_deg) == (pytest.approx(53.54), pytest.approx(9.98))
    assert reason([replace(REPORT, cog_deg=None)], 30, COURSE) is NoState.NO_SPEED


def errors_m(tracks: list[list[PositionReport]], method: TrackMethod) -> Iterator[float]:
    """Yield how far reports are from where the report 10 to 30 s before them puts the vessel."""
    settings = TrackSettings(method)
    for track in tracks:
        for index in range(1, len(track) - 1):
            target = track[index]
            earlier = next(
                (
                    report
                    for report in reversed(track[:index])
                    if 10 <= (target.fix_time - report.fix_time).total_seconds() < 30
                ),
                None,
            )
            if earlier is None or earlier.heading_deg is None:
                continue
            start = track.index(earlier)
            after_it = [track[index + 1]] if method is TrackMethod.HERMITE else []
            reports = [*track[max(0, start - 1) : start + 1], *after_it]
            found = state_at(reports, STATICS, target.fix_time, settings)
            if not isinstance(found, VesselState):
                continue
            way_m = found.speed_kn * MPS_PER_KN * found.age_s
            heading = radians(found.heading_deg)
            place = moved(found.lat_deg, found.lon_deg, way_m * sin(heading), way_m * cos(heading))
            yield hypot(*offset_m(target.lat_deg, target.lon_deg, *place))


def test_errors_on_five_minutes_of_real_traffic(shared_dir: Path) -> None:
    """On real reports 10 to 30 s old the methods err by about 3.7, 2.4, 2.3 and 0.9 m."""
    data = (shared_dir / "real/ais/dma_5min_2013-11-12_pghp.nmea.gz").read_bytes()
    by_vessel: dict[int, dict[datetime, PositionReport]] = defaultdict(dict)
    for report in decode_lines(gzip.decompress(data).splitlines(), NmeaDecoder()):
        if (
            isinstance(report, PositionReport)
            and report.fix_time_source is FixTimeSource.PROMPT
            and (report.sog_kn or 0) >= 0.5
        ):
            by_vessel[report.mmsi][report.fix_time] = report
    tracks = [[track[at] for at in sorted(track)] for track in by_vessel.values()]
    medians = [median(errors_m(tracks, method)) for method in TrackMethod]
    assert medians == pytest.approx([3.7, 2.4, 2.3, 0.9], abs=0.15)
