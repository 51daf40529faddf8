"""The cells of a table's row into values with units; what cannot be read names its column and fix.

Numbers and times are written in many ways, and the mapping says in which. Empty cells, the words
that archives write for "unknown" and AIS's own "not available" values become None. A cell that
should hold a number and does not costs its row, because a shifted column would otherwise move a
ship.
"""

import math
import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from zoneinfo import ZoneInfo

from app.domain.accounting import MessageReject
from app.domain.nmea_times import TimeReader
from app.domain.table_mapping import TableMapping, TimeFormat
from app.domain.table_names import UNKNOWN_WORDS

Cells = Mapping[str, str]
_SHOWN = 40
_DATE = re.compile(
    r"(\d{1,2})[./-](\d{1,2}|[A-Za-zä]{3})[./-](\d{4})"
    r"(?:[ T,]+(\d{1,2}):(\d\d)(?::(\d\d)(?:[.,](\d{1,6})\d*)?)?"
    r" ?([AaPp][Mm])?)? ?(?:(Z|UTC)|([+-]\d\d):?(\d\d))?"
)
_COMPACT = re.compile(r"(\d{4})(\d\d)(\d\d)[ T_-]?(\d\d)(\d\d)(\d\d)(?:[.,](\d{1,6})\d*)?(Z)?")
# As databases and spreadsheets shorten them, in English and in German.
_MONTHS = {
    "jan": 1, "feb": 2, "mar": 3, "apr": 4, "may": 5, "jun": 6, "jul": 7, "aug": 8, "sep": 9,
    "oct": 10, "nov": 11, "dec": 12, "mär": 3, "mrz": 3, "mai": 5, "okt": 10, "dez": 12,
}  # fmt: skip
_EXAMPLES = {
    TimeFormat.ISO: "an ISO date such as 2024-05-01T12:00:00Z, or an epoch in seconds",
    TimeFormat.DAY_FIRST: "a date with the day first such as 31/05/2024 12:00:00",
    TimeFormat.MONTH_FIRST: "a date with the month first such as 5/31/2024 12:00:00",
    TimeFormat.COMPACT: "a date such as 20240501120000",
}


class RowRejectedError(ValueError):
    """A row that is not taken: its bucket, and what is wrong with which column."""

    def __init__(self, reason: MessageReject, column: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason
        self.column = column


class CellReader:
    """Reads cells the way one mapping says; `not_after` bounds plausible times."""

    def __init__(self, mapping: TableMapping, not_after: datetime) -> None:
        self._decimal = mapping.decimal
        self._format = mapping.time_format
        self._zone: tzinfo = UTC if mapping.timezone == "UTC" else ZoneInfo(mapping.timezone)
        self._knots = mapping.speed_unit.knots
        self._times = TimeReader(not_after)

    def text(self, cells: Cells, name: str) -> str:
        """Return a cell's text; empty for what nobody knows."""
        text = cells.get(name, "")
        return "" if text.lower() in UNKNOWN_WORDS else text

    def number(self, cells: Cells, name: str) -> float | None:
        """Return a number, None for an empty cell. Raises RowRejectedError for anything else."""
        text = self.text(cells, name)
        if not text:
            return None
        try:
            value = float(text.replace(",", ".") if self._decimal == "," else text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise RowRejectedError(
                MessageReject.FIELD,
                name,
                f"{text[:_SHOWN]!r} is no number: give one or leave it empty",
            )
        return value

    def whole(self, cells: Cells, name: str) -> int | None:
        """Return a whole number, None for an empty cell."""
        value = self.number(cells, name)
        if value is not None and not value.is_integer():
            raise RowRejectedError(MessageReject.FIELD, name, f"{value} is not a whole number")
        return None if value is None else int(value)

    def place(self, cells: Cells, name: str, limit_deg: float) -> float:
        """Return a latitude or longitude, degrees within the limit."""
        value = self.number(cells, name)
        if value is None or abs(value) > limit_deg:
            found = "empty" if value is None else f"{value}"
            raise RowRejectedError(
                MessageReject.POSITION, name, f"{found}: give degrees within {limit_deg:g}"
            )
        return value

    def speed_kn(self, cells: Cells) -> float | None:
        """Return the speed over ground, kn; 102.3 kn and beyond, or below 0, is "not available"."""
        value = self.number(cells, "sog")
        return within(None if value is None else value * self._knots, 102.3)

    def distance_m(self, cells: Cells, name: str) -> float:
        """Return a distance, m; an empty cell is AIS's own zero."""
        value = self.number(cells, name) or 0.0
        if value < 0:
            raise RowRejectedError(
                MessageReject.FIELD, name, f"{value} m is negative: give the distance, m"
            )
        return value

    def moment(self, cells: Cells) -> datetime:
        """Return the row's time, UTC."""
        text = cells.get("time", "")
        if clock := cells.get("clock"):
            text = f"{text} {clock}"
        moment = self._read(text)
        if moment is None:
            raise RowRejectedError(
                MessageReject.TIME,
                "time",
                f"{text[:_SHOWN]!r} is no plausible time: give {_EXAMPLES[self._format]}",
            )
        return moment

    def _read(self, text: str) -> datetime | None:
        try:
            if self._format is TimeFormat.ISO:
                return self._times.epoch(text.encode()) or self._in_utc(
                    datetime.fromisoformat(text.removesuffix("UTC").rstrip().replace("/", "-"))
                )
            if self._format is TimeFormat.COMPACT:
                return self._in_utc(read_compact(text))
            return self._in_utc(read_date(text, day_first=self._format is TimeFormat.DAY_FIRST))
        except (ValueError, OverflowError):
            return None

    def _in_utc(self, stated: datetime) -> datetime | None:
        if stated.tzinfo is None:
            stated = stated.replace(tzinfo=self._zone)
        return self._times.plausible(stated.astimezone(UTC))


def within(value: float | None, end: float) -> float | None:
    """Return the value if it lies in [0, end): what is outside means "not available"."""
    return value if value is not None and 0 <= value < end else None


def read_date(text: str, *, day_first: bool) -> datetime:
    """Return a date such as 31/05/2024 1:02:03 PM, naive without a zone. Raises ValueError."""
    match = _DATE.fullmatch(text)
    if match is None:
        raise ValueError(text)
    is_named = not match[2].isdigit()
    day, month = (1, 2) if day_first or is_named else (2, 1)
    hour = int(match[4] or 0)
    if half := (match[8] or "").lower():
        if not 1 <= hour <= 12:
            raise ValueError(text)
        hour = hour % 12 + (12 if half == "pm" else 0)
    return datetime(
        int(match[3]),
        _MONTHS.get(match[month].lower(), 0) if is_named else int(match[month]),
        int(match[day]),
        hour,
        int(match[5] or 0),
        int(match[6] or 0),
        int((match[7] or "0").ljust(6, "0")),
        tzinfo=_zone(match[9], match[10], match[11]),
    )


def _zone(utc: str | None, hours: str | None, minutes: str | None) -> tzinfo | None:
    """Return the zone that stands behind a time, None without one."""
    if hours is None:
        return UTC if utc else None
    offset = timedelta(hours=abs(int(hours)), minutes=int(minutes or 0))
    return timezone(-offset if hours.startswith("-") else offset)


def read_compact(text: str) -> datetime:
    """Return a date such as 20240531T010203, naive without a zone. Raises ValueError."""
    match = _COMPACT.fullmatch(text)
    if match is None:
        raise ValueError(text)
    parts = [int(match[number]) for number in range(1, 7)]
    microsecond = int((match[7] or "0").ljust(6, "0"))
    return datetime(
        parts[0],
        parts[1],
        parts[2],
        parts[3],
        parts[4],
        parts[5],
        microsecond,
        tzinfo=UTC if match[8] else None,
    )
