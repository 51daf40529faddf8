"""How a table of AIS is to be read: which column is what, in which units, written in which way.

Every archive names and orders its columns in its own way, writes dates day first or month first,
speeds in knots or metres a second, decimals with a point or a comma. A mapping says all of it, so
that one reader reads all tables. It is proposed from the table (`table_proposal`), shown to a
person who may change it, and kept with the file, so that the file can be read again as it was.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

# What a column can hold, in the order of a plain table without a header; `COLUMNS` of these.
COLUMNS = (
    "mmsi",
    "time",
    "lat",
    "lon",
    "sog",
    "cog",
    "heading",
    "rot",
    "to_bow",
    "to_stern",
    "to_port",
    "to_starboard",
    "name",
    "ship_type",
)
# `clock` is a time of day beside a column of dates; `length` and `width` are all that some tables
# know of a hull.
FIELDS = (*COLUMNS, "callsign", "imo", "length", "width", "ais_class", "clock")
REQUIRED = ("mmsi", "time", "lat", "lon")
DELIMITERS = (",", ";", "\t", "|")
MOST_COLUMNS = 200


class TimeFormat(StrEnum):
    """How a table writes its times."""

    ISO = "iso"  # 2024-05-01T12:00:00Z, or an epoch in seconds or milliseconds
    DAY_FIRST = "day_first"  # 01/05/2024 12:00:00, 1.5.2024 12:00
    MONTH_FIRST = "month_first"  # 5/1/2024 12:00:00 PM
    COMPACT = "compact"  # 20240501120000


class SpeedUnit(StrEnum):
    """What speeds are counted in."""

    KNOTS = "kn"
    METRES_PER_SECOND = "m/s"
    KILOMETRES_PER_HOUR = "km/h"

    @property
    def knots(self) -> float:
        """How many knots one of it is."""
        return {"kn": 1.0, "m/s": 3600 / 1852, "km/h": 1000 / 1852}[self.value]


class MappingError(ValueError):
    """A mapping that no table can be read by; `field` says where it is wrong."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


@dataclass(frozen=True, slots=True)
class TableMapping:
    """Which column (from 0) holds what, and how the cells are written.

    Times without a zone of their own are in `timezone`. `decimal` is the mark before decimals.
    """

    columns: Mapping[str, int]
    has_header: bool = True
    delimiter: str = ","
    decimal: str = "."
    time_format: TimeFormat = TimeFormat.ISO
    timezone: str = "UTC"
    speed_unit: SpeedUnit = SpeedUnit.KNOTS

    @property
    def missing(self) -> list[str]:
        """The columns that no position can do without and that are not there."""
        return [name for name in REQUIRED if name not in self.columns]

    def as_dict(self) -> dict[str, Any]:
        """Return the mapping as JSON."""
        return {
            "columns": dict(self.columns),
            "has_header": self.has_header,
            "delimiter": self.delimiter,
            "decimal": self.decimal,
            "time_format": self.time_format.value,
            "timezone": self.timezone,
            "speed_unit": self.speed_unit.value,
        }

    @classmethod
    def of(cls, data: Mapping[str, Any], *, is_whole: bool = True) -> Self:
        """Read a mapping from JSON or a form. Raises MappingError naming the field.

        While somebody still chooses its columns it need not be whole.
        """
        unknown = sorted(set(data) - set(cls.__dataclass_fields__))
        if unknown:
            raise MappingError(str(unknown[0])[:40], "is no part of a mapping")
        mapping = cls(
            columns=_columns(data.get("columns")),
            has_header=_flag(data.get("has_header", True)),
            delimiter=_one_of("delimiter", data.get("delimiter", ","), DELIMITERS),
            decimal=_one_of("decimal", data.get("decimal", "."), (".", ",")),
            time_format=TimeFormat(
                _one_of("time_format", data.get("time_format", "iso"), tuple(TimeFormat))
            ),
            timezone=_zone(data.get("timezone", "UTC")),
            speed_unit=SpeedUnit(
                _one_of("speed_unit", data.get("speed_unit", "kn"), tuple(SpeedUnit))
            ),
        )
        if is_whole and mapping.missing:
            raise MappingError("columns", f"say which column holds {', '.join(mapping.missing)}")
        return mapping


def _columns(value: object) -> dict[str, int]:
    if not isinstance(value, Mapping):
        raise MappingError("columns", "give an object such as {'mmsi': 0, 'time': 1}, from 0")
    columns: dict[str, int] = {}
    for name, index in value.items():
        if name not in FIELDS:
            raise MappingError("columns", f"{str(name)[:40]!r} is none of {', '.join(FIELDS)}")
        if type(index) is not int or not 0 <= index < MOST_COLUMNS:
            raise MappingError("columns", f"{name} needs a column's number, 0 for the first")
        columns[name] = index
    return columns


def _one_of(field: str, value: object, choices: tuple[str, ...]) -> str:
    if not isinstance(value, str) or value not in choices:
        shown = ", ".join(repr(str(choice)) for choice in choices)
        raise MappingError(field, f"must be one of {shown}")
    return value


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise MappingError("has_header", "must be true or false")
    return value


def _zone(value: object) -> str:
    try:
        return ZoneInfo(str(value)).key
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        message = "must be a time zone such as UTC or Europe/Berlin"
        raise MappingError("timezone", message) from error
