"""How a camera's file names tell the time: patterns with strptime's letters, found in a name.

Unlike strptime, a pattern may stand anywhere in the name, because recorders like to add counters
and camera names around it.
"""

import re
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import PurePosixPath

COMMON_PATTERNS = (
    "%Y-%m-%dT%H-%M-%S",
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%d_%H-%M-%S",
    "%Y-%m-%d %H-%M-%S",
    "%Y-%m-%d %H.%M.%S",
    "%Y-%m-%d_%H%M%S",
    "%Y%m%dT%H%M%S",
    "%Y%m%d_%H%M%S",
    "%Y%m%d_%H%M%S%f",
    "%Y%m%d-%H%M%S",
    "%Y%m%d%H%M%S",
)
# The letters a pattern may use: digits of fixed width, found anywhere in a name.
LETTERS = {
    "%Y": r"(?P<Y>\d{4})",
    "%y": r"(?P<y>\d{2})",
    "%m": r"(?P<m>\d{2})",
    "%d": r"(?P<d>\d{2})",
    "%H": r"(?P<H>\d{2})",
    "%M": r"(?P<M>\d{2})",
    "%S": r"(?P<S>\d{2})",
    "%f": r"(?P<f>\d{1,6})",
    "%z": r"(?P<z>Z|[+-]\d{2}:?\d{2})",
    "%s": r"(?P<s>\d{10})",
}
ZONES = re.compile(r"[+-](0\d|1[0-4]):?(00|15|30|45)")
NEEDED = ("%m", "%d", "%H", "%M")


def check_pattern(pattern: str) -> str:
    """Return the pattern. Raises ValueError for one that could never tell a moment."""
    letters = re.findall(r"%.", pattern)
    unknown = sorted(set(letters) - LETTERS.keys())
    if unknown:
        raise ValueError(f"knows {', '.join(LETTERS)}, not {', '.join(unknown)}")
    if len(letters) != len(set(letters)):
        raise ValueError("uses a letter twice")
    has_day = set(NEEDED) <= set(letters) and not {"%Y", "%y"}.isdisjoint(letters)
    if "%s" not in letters and not has_day:
        raise ValueError(f"needs at least %Y {' '.join(NEEDED)}, or %s for seconds since 1970")
    return pattern


def told_by(name: str, pattern: str) -> datetime | None:
    """Return the moment that a name, with its ending or without, tells by one pattern, or None."""
    return _matched(PurePosixPath(name).stem, pattern)


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
    return _moment(found.groupdict()) if found else None


def _zoned(stem: str, pattern: str) -> re.Match[str] | None:
    """Find the pattern with a zone right behind it, which no one would drop on purpose.

    After a minus there may as well be a counter, unless the time is written as ISO 8601 does.
    """
    if not pattern.endswith("%S"):
        return None
    found = _expression(f"{pattern}%z").search(stem)
    if found is None or stem[found.end() :][:1].isalpha():
        return None
    zone = found["z"]
    is_zone = zone == "Z" or ((zone[0] == "+" or "T%H" in pattern) and ZONES.fullmatch(zone))
    return found if is_zone else None


@lru_cache(maxsize=256)
def _expression(pattern: str) -> re.Pattern[str]:
    parts = re.split(r"(%.)", pattern)
    expression = "".join(LETTERS.get(part, re.escape(part)) for part in parts)
    return re.compile(rf"(?<!\d){expression}(?!\d)")


def _moment(said: dict[str, str]) -> datetime | None:
    microsecond = int(said.get("f", "0").ljust(6, "0"))
    if "s" in said:
        return datetime.fromtimestamp(int(said["s"]), UTC).replace(microsecond=microsecond)
    try:
        moment = datetime(  # noqa: DTZ001  the zone follows, or is the camera's
            int(said["Y"]) if "Y" in said else 2000 + int(said["y"]),
            int(said["m"]),
            int(said["d"]),
            int(said["H"]),
            int(said["M"]),
            int(said.get("S", "0")),
            microsecond,
        )
        zone = said.get("z")
        return moment.replace(tzinfo=datetime.strptime(zone, "%z").tzinfo) if zone else moment
    except ValueError:
        return None
