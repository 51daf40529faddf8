"""A gauge's readings as a table: `time,level_m`, a line a reading.

Times are ISO 8601; without a zone they are in the site's. Columns may be separated by commas,
semicolons or tabs; where commas do not separate, they may stand for the decimal point.
"""

from datetime import datetime

from app.errors import FieldError, Invalid
from app.sites.fields import HIGHEST_M, in_zone

FIELD = "table"
COLUMNS = ("time", "level_m")
MOST_READINGS = 200_000  # ten-minute readings of almost four years
Reading = tuple[datetime, float]


def parse_levels(text: str, timezone: str, offset_m: float = 0.0) -> list[Reading]:
    """Return the readings in order of time, `offset_m` added to each level.

    Raises Invalid naming the line: no time, no number, a moment twice, or far too many.
    """
    lines = [
        (number, line)
        for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    if lines and "level_m" in lines[0][1].lower():
        _check_header(lines[0][1])
        lines = lines[1:]
    if not lines:
        raise Invalid.field(FIELD, f"has no readings; give lines of {','.join(COLUMNS)}")
    if len(lines) > MOST_READINGS:
        raise Invalid.field(FIELD, f"has {len(lines)} readings; at most {MOST_READINGS}")
    readings: dict[datetime, float] = {}
    for number, line in lines:
        moment, level_m = _reading(number, line, timezone)
        if moment in readings:
            raise _wrong(number, f"time {moment:%Y-%m-%d %H:%M:%S} UTC is there twice")
        readings[moment] = level_m + offset_m
    return sorted(readings.items())


def _check_header(line: str) -> None:
    columns = tuple(cell.strip().lower() for cell in line.split(_separator(line)))
    if columns != COLUMNS:
        raise Invalid.field(FIELD, f"knows the columns time,level_m; line 1 has {line.strip()}")


def _separator(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


def _reading(number: int, line: str, timezone: str) -> Reading:
    separator = _separator(line)
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    if len(cells) != len(COLUMNS):
        hint = "; decimal commas need semicolons between the columns" if separator == "," else ""
        raise _wrong(number, f"has {len(cells)} columns instead of time,level_m{hint}")
    try:
        moment = in_zone(datetime.fromisoformat(cells[0]), timezone, FIELD)
    except (ValueError, Invalid) as error:
        raise _wrong(
            number, f"{cells[0][:40]!r} is no time; write it like 2026-11-22T14:10:00Z"
        ) from error
    level = cells[1].replace(",", ".") if separator != "," else cells[1]
    try:
        level_m = float(level)
    except ValueError as error:
        raise _wrong(number, f"{level[:40]!r} is no level in metres") from error
    if not abs(level_m) <= HIGHEST_M:
        raise _wrong(number, f"level_m must lie within {HIGHEST_M} m")
    return moment, level_m


def _wrong(number: int, reason: str) -> Invalid:
    words = f"line {number}: {reason}"
    return Invalid(words, fields=(FieldError(FIELD, words),))
