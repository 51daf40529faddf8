"""Clocks that are whole hours off: summer time, another zone."""

from dataclasses import replace

import numpy as np
import pytest

from app.domain.clock_offset import OffsetSettings
from app.domain.vessel_path import VesselPath
from app.domain.zone_offset import ZoneSettings, find_offset, span_in_words
from tests.unit.domain.test_clock_offset import passages, photographs

SETTINGS = OffsetSettings(search_s=100.0)
ZONES = ZoneSettings(half_hours=3)


def later(paths: list[VesselPath], by_s: float) -> list[VesselPath]:
    """Return the same ways at other times."""
    return [replace(path, times_s=path.times_s + by_s) for path in paths]


@pytest.mark.parametrize(
    ("offset_s", "words"),
    [
        (3600.0, "1 h 0 s slow: looks like summer time"),
        (-5400.0, "1 h 30 min 0 s fast: looks like another time zone"),
        (3600.0 + 80, "1 h 1 min 20 s slow"),
    ],
)
def test_a_wrong_zone_is_found_and_named(offset_s: float, words: str) -> None:
    """Whole and half hours are found within a second, with what the clock is off besides."""
    rng = np.random.default_rng(1)
    paths = passages(rng)
    images = photographs(rng, paths, offset_s)

    found = find_offset(images, lambda _: paths, SETTINGS, ZONES)

    assert found.is_known
    assert found.is_suspect
    assert abs(found.offset_s - offset_s) < 1.0
    assert found.low_s < found.offset_s < found.high_s
    assert words.rsplit(":", maxsplit=1)[-1] in found.message
    assert find_offset(images, lambda _: paths, SETTINGS).is_known is False


def test_traffic_of_other_times_is_no_zone() -> None:
    """Where AIS of the images' own time is missing, no other hour's traffic is taken for it."""
    rng = np.random.default_rng(5)
    images = photographs(rng, passages(rng), 0.0)
    strangers = passages(rng)

    found = find_offset(images, lambda shift_s: later(strangers, shift_s), SETTINGS, ZONES)
    assert not found.is_known


def test_a_right_clock_is_not_searched_further() -> None:
    """Where the images agree with their own time, no other hour's reports are even read."""
    rng = np.random.default_rng(3)
    paths = passages(rng)
    asked: list[float] = []

    def around(shift_s: float) -> list[VesselPath]:
        asked.append(shift_s)
        return paths

    found = find_offset(photographs(rng, paths, 0.0), around, SETTINGS, ZONES)
    assert (found.is_known, found.is_off, asked) == (True, False, [0.0])


def test_spans_are_told_as_people_say_them() -> None:
    """Hours, minutes and seconds, without those that are none, and without a sign."""
    told = [span_in_words(one) for one in (0.4, 59.6, -3600.2, 5 * 3600 + 1802, 3580)]
    assert told == ["0 s", "1 min 0 s", "1 h 0 s", "5 h 30 min 2 s", "59 min 40 s"]
