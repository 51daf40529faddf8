"""How a camera's file names tell the time: patterns with strptime's letters, found in a name.

Unlike strptime, a pattern may stand anywhere in the name, because recorders like to add counters
and camera names around it.
"""

import re
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from functools import lru_cache
from pathlib import PurePosixPath

COMMON_PATTERNS = (
    "%Y-%m-%dT%H-%M-%S",
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%dT%H_%M_%S",
    "%Y-%m-%d_%H-%M-%S",
    "%Y-%m-%d_%H.%M.%S",
    "%Y-%m-%d %H-%M-%S",
    "%Y-%m-%d %H.%M.%S",
    "%Y-%m-%d at %H.%M.%S",
    "%Y-%m-%d_%H%M%S",
    "%Y-%m-%d-%H-%M-%S",
    "%Y_%m_%d_%H_%M_%S",
    "%Y%m%dT%H%M%S",
    "%Y%m%d_%H%M%S",
    "%Y%m%d_%H%M%S%f",
    "%Y%m%d-%H%M%S",
    "%Y%m%d%H%M%S",
    "%Y%m%d%H%M%S%f",
)
# The letters a pattern may use: digits of fixed width, found anywhere in a name.
LETTERS = {
    "%Y": r"(?P<Y>\d{4})",
    "%y": r"(?P<y>\d{2})",
    "%m": r"(?P<m>\d{2})",
    "%d": r"(?P<d>\d{2})",
    "%j": r"(?P<j>\d{3})",
    "%H": r"(?P<H>\d{2})",
    "%M": r"(?P<M>\d{2})",
    "%S": r"(?P<S>\d{2})",
    "%f": r"(?P<f>\d{1,6})",
    "%z": r"(?P<z>Z|[+-]\d{2}:?\d{2})",
    "%s": r"(?P<s>\d{10})",
}
_MAY_BE_SHORT = frozenset({"%m", "%d", "%H"})  # where no other digits touch them
ZONES = re.compile(r"[+-](0\d|1[0-4]):?(00|15|30|45)")
_FRACTION_AND_ZONE = r"(?:[.,](?P<f>\d{1,6})\d*)?%z"
_NAMED_ZONE = re.compile(
    r"(?:[.,]\d{1,9})?[ _-]?(?:UTC|GMT)(?:([+-])(\d{1,2})(?::?([0-5]\d))?)?(?![A-Za-z0-9])"
)
_HALF_OF_DAY = re.compile(r"(?:[.,]\d{1,9})?[\s_-]?([AaPp])\.?[Mm](?![A-Za-z])")
_IN_UTC = "PXL_"  # phones of Google name their photographs so, in UTC


def check_pattern(pattern: str) -> str:
    """Return the pattern. Raises ValueError for one that could never tell a moment."""
    letters = re.findall(r"%.", pattern)
    unknown = sorted(set(letters) - LETTERS.keys())
    if unknown:
        raise ValueError(f"knows {', '.join(LETTERS)}, not {', '.join(unknown)}")
    if len(letters) != len(set(letters)):
        raise ValueError("uses a letter twice")
    has_day = {"%m", "%d"} <= set(letters) or "%j" in letters
    has_time = {"%H", "%M"} <= set(letters) and not {"%Y", "%y"}.isdisjoint(letters)
    if "%s" not in letters and not (has_day and has_time):
        raise ValueError(
            "needs at least %Y %m %d %H %M (or %j, the day of the year, for %m %d), "
            "or %s for seconds since 1970"
        )
    return pattern


def told_by(name: str, pattern: str) -> datetime | None:
    """Return the moment that a name, with its ending or without, tells by one pattern, or None.

    A pattern with a slash is looked for in the folders too, where `name` has them.
    """
    return _matched(_stem(name, pattern), pattern)


def has_shape(name: str, pattern: str) -> bool:
    """Whether a name has digits where a pattern looks for them, a moment or not."""
    return _expression(pattern).search(_stem(name, pattern)) is not None


def _stem(name: str, pattern: str) -> str:
    path = PurePosixPath(name)
    return f"{path.parent}/{path.stem}" if "/" in pattern else path.stem


def from_file_name(file_name: str, pattern: str | None) -> datetime | None:
    """Return the moment a file's name tells by the camera's pattern or a common one, or None."""
    stem = PurePosixPath(file_name).stem
    for candidate in (pattern, *COMMON_PATTERNS):
        moment = _matched(stem, candidate) if candidate else None
        if moment is not None:
            return moment
    return None


def _matched(stem: str, pattern: str) -> datetime | None:
    found = _zoned(stem, pattern) or _expression(pattern).search(stem)
    if found is None:
        return None
    moment = _moment(found.groupdict(), _HALF_OF_DAY.match(stem, found.end()))
    if moment is None or moment.tzinfo is not None:
        return moment
    if named := _NAMED_ZONE.match(stem, found.end()):
        return moment.replace(tzinfo=_named(named))
    return moment.replace(tzinfo=UTC) if stem.startswith(_IN_UTC) else moment


def _zoned(stem: str, pattern: str) -> re.Match[str] | None:
    """Find the pattern with a zone right behind it, which no one would drop on purpose.

    After a minus there may as well be a counter, unless the time is written as ISO 8601 does.
    """
    if not pattern.endswith(("%S", "%f")):
        return None
    behind = _FRACTION_AND_ZONE if "%f" not in pattern else "%z"
    found = _expression(pattern, behind).search(stem)
    if found is None or stem[found.end() :][:1].isalpha():
        return None
    zone = found["z"]
    is_zone = zone == "Z" or ((zone[0] == "+" or "T%H" in pattern) and ZONES.fullmatch(zone))
    return found if is_zone else None


def _named(zone: re.Match[str]) -> tzinfo:
    """Return the zone of `UTC`, `GMT+2` or `UTC+05:45`."""
    offset = timedelta(hours=int(zone[2] or 0), minutes=int(zone[3] or 0))
    if offset > timedelta(hours=14):
        return UTC
    return timezone(-offset if zone[1] == "-" else offset)


@lru_cache(maxsize=256)
def _expression(pattern: str, behind: str = "") -> re.Pattern[str]:
    parts = re.split(r"(%.)", pattern)
    expression = "".join(
        _digits(parts, place) if place % 2 else re.escape(part) for place, part in enumerate(parts)
    )
    tail = behind.replace("%z", LETTERS["%z"])
    return re.compile(rf"(?<!\d){expression}{tail}(?!\d)")


def _digits(parts: list[str], place: int) -> str:
    """Return the expression of a letter; one that stands apart may lack its leading zero."""
    letter = parts[place]
    before, after = parts[place - 1][-1:], parts[place + 1][:1]
    is_first, is_last = place == 1, place == len(parts) - 2
    stands_apart = (is_first or before != "") and (is_last or after != "")
    touches_digits = before.isdigit() or after.isdigit()
    digits = LETTERS.get(letter, re.escape(letter))
    is_short = letter in _MAY_BE_SHORT and stands_apart and not touches_digits
    return digits.replace("{2}", "{1,2}") if is_short else digits


def _moment(said: dict[str, str | None], half_of_day: re.Match[str] | None) -> datetime | None:
    told = {letter: digits for letter, digits in said.items() if digits is not None}
    microsecond = int(told.get("f", "0").ljust(6, "0"))
    if "s" in told:
        return datetime.fromtimestamp(int(told["s"]), UTC).replace(microsecond=microsecond)
    hour = int(told["H"])
    if half_of_day and 1 <= hour <= 12:
        hour = hour % 12 + (12 if half_of_day[1] in "Pp" else 0)
    try:
        moment = datetime(  # noqa: DTZ001  the zone follows, or is the camera's
            int(told["Y"]) if "Y" in told else 2000 + int(told["y"]),
            int(told.get("m", "1")),
            int(told.get("d", "1")),
            hour,
            int(told["M"]),
            int(told.get("S", "0")),
            microsecond,
        )
        moment = _on_day(moment, told.get("j"))
        zone = told.get("z")
        return moment.replace(tzinfo=datetime.strptime(zone, "%z").tzinfo) if zone else moment
    except (ValueError, OverflowError):
        return None


def _on_day(moment: datetime, of_year: str | None) -> datetime:
    """Return the moment on a day of its year, from 1. Raises ValueError for a day it has not."""
    if of_year is None:
        return moment
    later = moment + timedelta(days=int(of_year) - 1)
    if later.year != moment.year:
        raise ValueError(of_year)
    return later
