"""Latitudes and longitudes as people type them: decimal degrees, or degrees, minutes and seconds.

`53.5426`, `53,5426`, `53°32'33.4"N`, `53 32 33.4 N`, `N53 32.557`, `-9:58:51`. What could mean two
things is refused with the fix, because a landmark a minute of arc away looks like any other.
"""

import re
from enum import StrEnum

# Degree signs, primes, quotes, dashes and spaces that keyboards and web pages make of ours.
_SYMBOLS = str.maketrans(
    dict.fromkeys("\u00ba\u02da", "°")
    | dict.fromkeys("\u2032\u2019\u2018\u00b4`", "'")
    | dict.fromkeys("\u2033\u201d\u201c", '"')
    | dict.fromkeys("\u2212\u2013", "-")
    | dict.fromkeys("\u00a0\u202f\t", " ")
)
_NUMBER = r"\d{1,9}(?:[.,]\d{0,40})?"
_ANGLE = re.compile(
    rf"""(?P<before>[NSEW])?\s*(?P<sign>[+-])?\s*
    (?P<degrees>{_NUMBER})
    (?:(?:\s*[°:]\s*|\s+)(?P<minutes>{_NUMBER})
       (?:(?:\s*[':]\s*|\s+)(?P<seconds>{_NUMBER})\s*(?:"|'')?|\s*')?
     |\s*°)?
    \s*(?P<after>[NSEW])?""",
    re.VERBOSE | re.IGNORECASE,
)
_SCIENTIFIC = re.compile(r"[+-]?\d+(\.\d*)?[eE][+-]?\d{1,3}")  # as programs write small numbers
_EXAMPLE = {"lat": "53.54261 or 53°32'33.4\"N", "lon": "9.98083 or 9°58'51.0\"E"}
_LONGEST = 120


class Axis(StrEnum):
    """Which of the two a text is to be."""

    LATITUDE = "lat"
    LONGITUDE = "lon"

    @property
    def word(self) -> str:
        """The axis in words."""
        return "latitude" if self is Axis.LATITUDE else "longitude"

    @property
    def other(self) -> "Axis":
        """The other axis."""
        return Axis.LONGITUDE if self is Axis.LATITUDE else Axis.LATITUDE

    @property
    def limit_deg(self) -> int:
        """Its largest value."""
        return 90 if self is Axis.LATITUDE else 180

    @property
    def letters(self) -> tuple[str, str]:
        """Its hemispheres, the positive one first."""
        return ("N", "S") if self is Axis.LATITUDE else ("E", "W")


def parse_angle(text: str, axis: Axis) -> float:
    """Read a latitude or longitude, degrees. Raises ValueError with the reason and the fix."""
    plain = text.translate(_SYMBOLS).strip()
    if _SCIENTIFIC.fullmatch(plain):
        return _within(float(plain), axis)
    found = _ANGLE.fullmatch(plain) if len(plain) <= _LONGEST else None
    if found is None:
        hint = "; write E for east, not O" if re.search("[Oo]", plain) else ""
        raise ValueError(f"is no {axis.word}: write it like {_EXAMPLE[axis.value]}{hint}")
    sign = _sign(found, axis)
    parts = [found[name] for name in ("degrees", "minutes", "seconds") if found[name]]
    values = [float(part.replace(",", ".").rstrip(".")) for part in parts]
    if any("." in part or "," in part for part in parts[:-1]):
        raise ValueError("only its last part may have decimals")
    for value, name in zip(values[1:], ("minutes", "seconds"), strict=False):
        if value >= 60:
            raise ValueError(f"has {value:g} {name}, but there are only 60; check the digits")
    degrees = sum(value / 60.0**power for power, value in enumerate(values))
    return _within(sign * degrees, axis)


def parse_place(text: str) -> tuple[float, float]:
    """Read latitude and longitude (deg) from one text, latitude first unless letters say otherwise.

    Raises ValueError with the reason and the fix.
    """
    first, second = _halves(text[:_LONGEST].translate(_SYMBOLS).strip())
    if re.search("[EWew]", first) and re.search("[NSns]", second):
        first, second = second, first
    try:
        lat_deg = parse_angle(first, Axis.LATITUDE)
    except ValueError as error:
        raise ValueError(f"latitude {first!r} {error}") from error
    try:
        return lat_deg, parse_angle(second, Axis.LONGITUDE)
    except ValueError as error:
        raise ValueError(f"longitude {second!r} {error}") from error


def _within(degrees: float, axis: Axis) -> float:
    if abs(degrees) > axis.limit_deg:
        hint = " (is it the longitude?)" if axis is Axis.LATITUDE and abs(degrees) <= 180 else ""
        raise ValueError(f"must lie between -{axis.limit_deg} and {axis.limit_deg} degrees{hint}")
    return degrees


def _sign(found: re.Match[str], axis: Axis) -> int:
    before, after = (found["before"] or "").upper(), (found["after"] or "").upper()
    if before and after:
        raise ValueError(f"names two hemispheres, {before} and {after}; keep one")
    letter = before or after
    if letter in axis.other.letters:
        raise ValueError(f"is a {axis.other.word} ({letter}); latitude and longitude are exchanged")
    if letter and found["sign"]:
        raise ValueError(f"has a sign and a hemisphere ({letter}); keep one of them")
    return -1 if found["sign"] == "-" or letter == axis.letters[1] else 1


def _halves(text: str) -> tuple[str, str]:
    """Cut a text into its two angles: at letters, a semicolon, a comma or a space."""
    patterns = (
        r"(.*[NSEWnsew])[\s,;/]*([^NSEWnsew]*[NSEWnsew])",  # letters behind
        r"([NSEWnsew][^NSEWnsew]*?)[\s,;/]*([NSEWnsew].*)",  # letters in front
        r"([^;]*);([^;]*)",
        r"(.*?),\s+(.*)",
        r"([^,\s]+),([^,\s]+)",
        r"(\S+)\s+(\S+)",
    )
    for pattern in patterns:
        cut = re.fullmatch(pattern, text)
        if cut is not None:
            return cut[1].strip(" ,;/"), cut[2].strip(" ,;/")
    raise ValueError(f"holds no two coordinates; write them like {_EXAMPLE['lat']}; 9.98083")
