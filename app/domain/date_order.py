"""Whether a table's dates have the day or the month first, as far as the dates themselves tell.

`05/31/2024` tells, and so do a month's name and an hour of twelve; `05/01/2024` does not, and read
the wrong way it moves a ship by months without a sign. A table whose rows all leave it open is
therefore a question to a person, never a guess.
"""

import re
from collections.abc import Iterable

from app.domain.table_mapping import TimeFormat

_PARTS_OF_DATE = re.compile(r"(\d{1,2})([./-])(\d{1,2}|[A-Za-zä]{3})[./-]\d{4}(.*)")
_MONTHS = 12


def is_date(text: str) -> bool:
    """Whether a time begins with a day and a month in one order or the other."""
    return _PARTS_OF_DATE.fullmatch(text) is not None


def told_order(text: str) -> TimeFormat | None:
    """Return the order that a date can only have been written in; None where both are possible."""
    match = _PARTS_OF_DATE.fullmatch(text)
    if match is None:
        return None
    if not match[3].isdigit() or int(match[1]) > _MONTHS:
        return TimeFormat.DAY_FIRST
    if int(match[3]) > _MONTHS or "M" in match[4].upper():
        return TimeFormat.MONTH_FIRST
    return None


def is_unsure(text: str) -> bool:
    """Whether a date means another day read the other way; nobody writes dots month first."""
    match = _PARTS_OF_DATE.fullmatch(text)
    return (
        match is not None
        and match[2] != "."
        and told_order(text) is None
        and int(match[1]) != int(match[3])
    )


def first_told(texts: Iterable[str]) -> TimeFormat | None:
    """Return the order of the first date that tells it, None if none does."""
    last = ""
    for text in texts:
        day = text[:10]
        if day != last and (order := told_order(text)):
            return order
        last = day
    return None
