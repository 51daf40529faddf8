"""Times in file names."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.sites.name_pattern import COMMON_PATTERNS, check_pattern, from_file_name, told_by

MOMENTS = st.datetimes(datetime(1990, 1, 1), datetime(2100, 1, 1)).map(  # noqa: DTZ001  naive
    lambda moment: moment.replace(microsecond=0)
)


@given(MOMENTS, st.sampled_from(COMMON_PATTERNS), st.sampled_from(["", "cam-3 ", "x_"]))
def test_common_patterns_are_found_anywhere(moment: datetime, pattern: str, before: str) -> None:
    """Whatever stands around it, a common pattern gives its moment."""
    name = f"{before}{moment.strftime(pattern)} (1).jpeg"
    assert from_file_name(name, None) == moment


@given(st.text(max_size=60), st.text(max_size=20))
def test_no_name_is_too_strange(name: str, pattern: str) -> None:
    """Any name and any accepted pattern give a moment or None, never an error."""
    try:
        check_pattern(pattern)
    except ValueError:
        pattern = ""
    found = from_file_name(name, pattern or None)
    assert found is None or isinstance(found, datetime)


def test_a_camera_pattern_comes_first() -> None:
    """The camera's own pattern wins; seconds since 1970 and zones are understood."""
    assert from_file_name("20260102_030405_1767323045.jpg", "%s") == datetime(
        2026, 1, 2, 3, 4, 5, tzinfo=UTC
    )
    found = from_file_name("a(2026.01.02 03h04 +0200).png", "(%Y.%m.%d %Hh%M %z)")
    assert found is not None
    assert found.astimezone(UTC) == datetime(2026, 1, 2, 1, 4, tzinfo=UTC)


@pytest.mark.parametrize("pattern", ["cam", "%Y%m%d", "%Y%Y%m%d%H%M", "%Y%m%d%H%M%p"])
def test_useless_patterns_are_refused(pattern: str) -> None:
    """A pattern without date and time, with a letter twice or an unknown one, is refused."""
    with pytest.raises(ValueError, match=r"needs|twice|knows"):
        check_pattern(pattern)


@pytest.mark.parametrize(
    ("name", "offset_h"),
    [
        ("IMG_20260701T101112+0200.jpg", 2),
        ("20260701T101112-0300.jpg", -3),
        ("2026-07-01T10:11:12+05:30.jpg", 5.5),
        ("20260701_101112Z.jpg", 0),
        ("cam_20260701_101112-0300.jpg", None),  # as likely picture 300
        ("cam_20260701_101112+0001.jpg", None),
        ("20260701_101112Zoom.jpg", None),
        ("20260701T101112.345Z.jpg", 0),
        ("20260701_101112 UTC.jpg", 0),
        ("20260701_101112 GMT+5:45.jpg", 5.75),
        ("PXL_20260701_101112.jpg", 0),  # always UTC
    ],
)
def test_a_zone_behind_the_time_is_heeded(name: str, offset_h: float | None) -> None:
    """A zone that a name tells is not the camera's; what may be a counter is no zone."""
    for pattern in (None, "%Y%m%d_%H%M%S"):
        moment = from_file_name(name, pattern)
        assert moment is not None
        wanted = None if offset_h is None else timedelta(hours=offset_h)
        assert moment.utcoffset() == wanted


@pytest.mark.parametrize(
    ("name", "pattern", "hour"),
    [
        ("WhatsApp Image 2026-07-01 at 9.11.12 PM (1).jpeg", None, 21),
        ("Screenshot 2026-07-01 at 12.11.12\u202fAM.png", None, 0),
        ("2026-07-01 13.11.12 PMs.jpg", None, 13),
        ("7_1_2026 1_11_12 PM.jpg", "%m_%d_%Y %H_%M_%S", 13),
        ("2026182_101112.jpg", "%Y%j_%H%M%S", 10),
        ("cam/2026-07-01/10-11-12.jpg", "%Y-%m-%d/%H-%M-%S", 10),
    ],
)
def test_names_are_written_in_many_ways(name: str, pattern: str | None, hour: int) -> None:
    """Halves of the day, single digits, days of the year and folders are heeded."""
    found = from_file_name(name, None) if pattern is None else told_by(name, pattern)
    assert found is not None
    assert (found.month, found.day, found.hour, found.minute) == (7, 1, hour, 11)
