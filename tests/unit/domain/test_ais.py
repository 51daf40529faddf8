"""What the fields of AIS messages mean."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain import ais
from app.domain.ais import FixTimeSource

NOON = datetime(2024, 5, 1, 12, 0, 0, tzinfo=UTC)


@pytest.mark.parametrize(
    ("meaning", "raw", "value"),
    [
        (ais.latitude_deg, 91 * 600_000, None),
        (ais.latitude_deg, -90 * 600_000, -90.0),
        (ais.longitude_deg, 181 * 600_000, None),
        (ais.longitude_deg, 108_000_001, None),
        (ais.longitude_deg, 1, 1 / 600_000),
        (ais.speed_kn, 1023, None),
        (ais.speed_kn, 1022, 102.2),
        (ais.course_deg, 3600, None),
        (ais.course_deg, 3599, 359.9),
        (ais.heading_deg, 511, None),
        (ais.heading_deg, 360, None),
        (ais.heading_deg, 359, 359.0),
        (ais.rate_of_turn_deg_min, -128, None),
        (ais.rate_of_turn_deg_min, 127, None),
        (ais.rate_of_turn_deg_min, -127, None),
        (ais.rate_of_turn_deg_min, 0, 0.0),
    ],
)
def test_reserved_values_become_none(meaning: object, raw: int, value: float | None) -> None:
    """A value that the standard reserves for "not available" is never taken as a measurement."""
    assert callable(meaning)
    assert meaning(raw) == value


def test_rate_of_turn_keeps_its_side() -> None:
    """The rate of turn is the signed square of raw / 4.733."""
    assert ais.rate_of_turn_deg_min(47) == pytest.approx(98.61, abs=0.01)
    assert ais.rate_of_turn_deg_min(-47) == pytest.approx(-98.61, abs=0.01)


@pytest.mark.parametrize(
    ("mmsi", "is_vessel"),
    [
        (211_000_001, True),
        (799_999_999, True),
        (982_110_001, True),  # an auxiliary craft
        (2_190_067, False),  # coast station 002190067
        (23_456_789, False),  # group 023456789
        (111_211_001, False),  # rescue aircraft
        (970_000_001, False),
        (972_000_001, False),
        (974_000_001, False),
        (992_190_917, False),  # aid to navigation
        (812_345_678, False),  # handheld radio
        (1_073_741_823, False),  # all thirty bits
        (0, False),
    ],
)
def test_only_vessels_are_vessels(mmsi: int, is_vessel: bool) -> None:  # noqa: FBT001 - a table of truth
    """Coast stations, groups, aircraft, distress devices and buoys are told from vessels."""
    assert ais.is_vessel_mmsi(mmsi) is is_vessel


@given(
    second=st.integers(0, 59),
    lag_s=st.floats(-2, 5),
    minute=st.integers(0, 10_000),
)
def test_a_prompt_fix_is_recovered(second: int, lag_s: float, minute: int) -> None:
    """A fix up to 2 s after or 5 s before its reception is dated to its own second, any minute."""
    fixed_at = NOON + timedelta(minutes=minute, seconds=second)
    moment, source = ais.fix_time(fixed_at + timedelta(seconds=lag_s), second)
    assert source is FixTimeSource.PROMPT
    assert moment == fixed_at


@given(second=st.integers(0, 59), lag_s=st.floats(5.001, 57.999))
def test_a_contradicting_second_is_doubtful(second: int, lag_s: float) -> None:
    """A second that cannot have just passed dates nothing: the reception does, marked doubtful."""
    received_at = NOON + timedelta(seconds=second + lag_s)
    assert ais.fix_time(received_at, second) == (received_at, FixTimeSource.DOUBTFUL)


@pytest.mark.parametrize("second", [60, 61, 62, 63])
def test_without_a_second_reception_counts(second: int) -> None:
    """Seconds 60 to 63 mean "no time": the reception is used, with a sigma of 2 s."""
    assert ais.fix_time(NOON, second) == (NOON, FixTimeSource.RECEIVED)


@pytest.mark.parametrize(
    ("raw", "text"),
    [("ELBE 3@@@@@", "ELBE 3"), ("  TUG  @@ ", "TUG"), ("@@@@", None), ("", None)],
)
def test_text_is_stripped(raw: str, text: str | None) -> None:
    """Padding around names goes, and a name of nothing but padding is no name."""
    assert ais.clean_text(raw) == text


def test_antenna_distances_are_unknown_only_together() -> None:
    """Four zeros mean "unknown"; a single zero means an antenna at that edge."""
    assert ais.antenna_distances_m(0, 0, 0, 0) == (None, None, None, None)
    assert ais.antenna_distances_m(0, 30, 4, 4) == (0.0, 30.0, 4.0, 4.0)
