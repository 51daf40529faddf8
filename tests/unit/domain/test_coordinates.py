"""Coordinates as people type them, right ones and wrong ones."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.coordinates import Axis, parse_angle, parse_place

LATITUDE = 53 + 32 / 60 + 33.4 / 3600


@pytest.mark.parametrize(
    "text",
    [
        "53°32'33.4\"N",
        "53 32 33.4 N",
        "N53 32 33.4",
        "n 53° 32\u2032 33,4\u2033",
        "53:32:33.4",
        "53 32.556666666666667",
        "53° 32,556666666666667' N",
        "+53.54261111111111",
        "53,54261111111111",
        "53.54261111111111°",
        "53°32'33.4''",
        "  53\u00a032\u00a033.4\u00a0N ",
    ],
)
def test_usual_ways_to_write_a_latitude_mean_the_same(text: str) -> None:
    """Decimal, DMS and decimal minutes, with points or commas, signs or letters."""
    assert parse_angle(text, Axis.LATITUDE) == pytest.approx(LATITUDE, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "value"),
    [("9°58'51\"E", 9.980833333), ("9 58 51 W", -9.980833333), ("-0 0 36", -0.01), ("180", 180)],
)
def test_signs_and_letters_turn_a_longitude(text: str, value: float) -> None:
    """West and minus are negative, also between 0 and -1 degree."""
    assert parse_angle(text, Axis.LONGITUDE) == pytest.approx(value, abs=1e-8)


@pytest.mark.parametrize(
    ("text", "axis", "reason"),
    [
        ("53°61'33\"N", Axis.LATITUDE, "61 minutes"),
        ("53 32 60", Axis.LATITUDE, "60 seconds"),
        ("N53 32 33 S", Axis.LATITUDE, "two hemispheres"),
        ("-53.5 S", Axis.LATITUDE, "sign and a hemisphere"),
        ("9.98 E", Axis.LATITUDE, "is a longitude"),
        ("53 N", Axis.LONGITUDE, "is a latitude"),
        ("91", Axis.LATITUDE, "between -90 and 90 degrees .is it the longitude"),
        ("181", Axis.LONGITUDE, "between -180 and 180"),
        ("53.5 32", Axis.LATITUDE, "last part"),
        ("9 58 51 O", Axis.LONGITUDE, "not O"),
        ("", Axis.LATITUDE, "is no latitude"),
        ("nan", Axis.LATITUDE, "is no latitude"),
        ("53 32 33 12", Axis.LATITUDE, "is no latitude"),
        ("=53", Axis.LATITUDE, "is no latitude"),
        ("5" * 5000, Axis.LATITUDE, "is no latitude"),
    ],
)
def test_what_makes_no_sense_is_refused_with_the_fix(text: str, axis: Axis, reason: str) -> None:
    """Minutes beyond 59, two hemispheres, exchanged axes and no numbers are told apart."""
    with pytest.raises(ValueError, match=reason):
        parse_angle(text, axis)


@pytest.mark.parametrize(
    "text",
    [
        "53°32'33.4\"N 9°58'51\"E",
        "53 32 33.4 N, 9 58 51 E",
        "N53 32 33.4 E9 58 51",
        "E9 58 51, N53 32 33.4",
        "9°58'51\"E, 53°32'33.4\"N",
        "53,54261111; 9,98083333",
        "53.54261111, 9.98083333",
        "53.54261111,9.98083333",
        "53.54261111 9.98083333",
    ],
)
def test_both_coordinates_are_read_from_one_text(text: str) -> None:
    """What maps and receivers put on the clipboard is taken; letters tell the order."""
    assert parse_place(text) == pytest.approx((LATITUDE, 9.98083333), abs=1e-7)


@pytest.mark.parametrize("text", ["53.5", "", "53 61 0 N, 9 0 0 E", "a b"])
def test_half_a_place_is_refused(text: str) -> None:
    """One angle, or a wrong one, is no place."""
    with pytest.raises(ValueError, match=r"coordinates|latitude"):
        parse_place(text)


@given(
    degrees=st.floats(-90, 90, allow_nan=False),
    comma=st.booleans(),
    style=st.sampled_from(["decimal", "minutes", "seconds"]),
)
def test_what_is_written_is_read_back(degrees: float, style: str, *, comma: bool) -> None:
    """Any latitude written in any style comes back to a tenth of a millimetre."""
    size = abs(degrees)
    whole = int(size)
    minutes = (size - whole) * 60
    letter = "S" if degrees < 0 else "N"
    if style == "decimal":
        text = f"{size:.12f} {letter}"
    elif style == "minutes":
        text = f"{whole}° {minutes:.9f}' {letter}"
        if f"{minutes:.9f}".startswith("60"):
            return
    else:
        seconds = f"{(minutes - int(minutes)) * 60:.7f}"
        if seconds.startswith("60"):
            return
        text = f"{letter}{whole} {int(minutes)} {seconds}"
    if comma:
        text = text.replace(".", ",")
    assert parse_angle(text, Axis.LATITUDE) == pytest.approx(degrees, abs=1e-9)


@given(st.text(max_size=40))
def test_no_text_does_worse_than_a_reason(text: str) -> None:
    """Anything typed is either an angle within its limits or refused with a ValueError."""
    try:
        value = parse_angle(text, Axis.LONGITUDE)
    except ValueError as error:
        assert str(error)  # noqa: PT017  either outcome is right
    else:
        assert -180 <= value <= 180
