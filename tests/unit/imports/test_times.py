"""When a file of a batch was taken, by the rule chosen for the batch."""

from datetime import UTC, datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.imports.rules import TimeRule
from app.imports.times import Doubt, RepeatedHour, Telling, TimeSettings, told
from app.tables.imagery import CaptureTimeSource

BERLIN = TimeSettings(timezone="Europe/Berlin")
NAMED = "a/cam_20260701_120000.jpg"


def naive(*parts: int) -> datetime:
    """Return a moment as a clock shows it."""
    return datetime(*parts)  # type: ignore[arg-type]  # noqa: DTZ001


@pytest.mark.parametrize(
    ("shown", "settings", "utc", "doubt"),
    [
        ((2026, 7, 1, 12), BERLIN, (2026, 7, 1, 10), None),
        ((2026, 1, 1, 12), BERLIN, (2026, 1, 1, 11), None),
        ((2026, 10, 25, 2, 30), BERLIN, (2026, 10, 25, 0, 30), Doubt.REPEATED),
        (
            (2026, 10, 25, 2, 30),
            BERLIN.model_copy(update={"repeated_hour": RepeatedHour.LATER}),
            (2026, 10, 25, 1, 30),
            Doubt.REPEATED,
        ),
        ((2026, 3, 29, 2, 30), BERLIN, (2026, 3, 29, 1, 30), Doubt.MISSING),
        (
            (2026, 7, 1, 12),
            BERLIN.model_copy(update={"follows_summer_time": False}),
            (2026, 7, 1, 11),
            None,
        ),
        (
            (2026, 1, 1, 12),
            TimeSettings(timezone="Europe/Dublin", follows_summer_time=False),
            (2026, 1, 1, 12),
            None,
        ),
    ],
    ids=[
        "summer",
        "winter",
        "first pass",
        "second pass",
        "missing hour",
        "no summer time",
        "Irish",
    ],
)
def test_a_clock_without_a_zone_is_read_in_the_batchs(
    shown: tuple[int, ...], settings: TimeSettings, utc: tuple[int, ...], doubt: Doubt | None
) -> None:
    """Summer time counts as chosen; moments that come twice or never are taken and told."""
    found = told(Telling("x.jpg", exif_at=naive(*shown)), settings)
    assert found is not None
    assert (found.moment, found.doubt) == (naive(*utc).replace(tzinfo=UTC), doubt)


def test_the_rule_chooses_the_source() -> None:
    """Each rule takes its own source and no other; `auto` takes EXIF before the name."""
    zoned = datetime(2026, 7, 1, 8, tzinfo=timezone(timedelta(hours=5)))
    telling = Telling(NAMED, zoned, naive(2026, 7, 1, 9), datetime(2026, 7, 1, 9, tzinfo=UTC))
    hours = {
        rule: (found.moment.hour, found.source)
        for rule in TimeRule
        if (found := told(telling, BERLIN.model_copy(update={"rule": rule})))
    }
    assert hours == {
        TimeRule.AUTO: (3, CaptureTimeSource.EXIF),
        TimeRule.EXIF: (3, CaptureTimeSource.EXIF),
        TimeRule.FILE_NAME: (10, CaptureTimeSource.FILE_NAME),
        TimeRule.CSV: (7, CaptureTimeSource.CSV),
        TimeRule.FILE_TIME: (9, CaptureTimeSource.FILE_TIME),
    }
    assert told(Telling("x.jpg"), BERLIN) is None


@given(st.datetimes(datetime(2000, 1, 1), datetime(2100, 1, 1)), st.sampled_from(RepeatedHour))  # noqa: DTZ001  a clock
def test_a_told_moment_is_within_a_day_of_the_clock(shown: datetime, which: RepeatedHour) -> None:
    """No zone is further from UTC than that, whatever the clock shows and however it is read."""
    settings = BERLIN.model_copy(update={"repeated_hour": which})
    found = told(Telling("x.jpg", exif_at=shown), settings)
    assert found is not None
    assert abs(found.moment.replace(tzinfo=None) - shown) <= timedelta(hours=2)
