"""Decoded reports on their way to the database: as many rows as one transaction writes.

Values are as the database's driver wants them. Many positions stay columns until it takes them, row
by row: hundreds of thousands of tuples would keep Python's garbage collector busy. Those of one
place and vessel stand together, so that the indexes which lead to a place or a vessel are written
page by page: that is most of the work of storing.
"""

from datetime import datetime
from typing import Any

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import PositionTable
from app.domain.cells import cell_of, cells_of
from app.domain.payload_bits import IntArray

Row = tuple[Any, ...]
Columns = list[list[Any]]
POSITION_COLUMNS = (
    "mmsi",
    "fix_time",
    "received_at",
    "lat_deg",
    "lon_deg",
    "sog_kn",
    "cog_deg",
    "heading_deg",
    "rot_deg_min",
    "message_type",
    "ais_class",
    "high_accuracy",
    "fix_time_source",
    "cell",
)
STATIC_COLUMNS = (
    "mmsi",
    "received_at",
    "name",
    "callsign",
    "imo",
    "ship_type",
    "to_bow_m",
    "to_stern_m",
    "to_port_m",
    "to_starboard_m",
    "mothership_mmsi",
)
_MOST = 40_000
_LARGEST_INTEGER = 2**31 - 1
_MILLISECONDS = [f".{millisecond:03}000" for millisecond in range(1000)]


class RowBatch:
    """Rows gathered until there are enough for a transaction; they fit into memory."""

    def __init__(self) -> None:
        self._tables: list[PositionTable] = []
        self._in_tables = 0
        self._positions: list[Row] = []
        self.statics: list[Row] = []

    @property
    def is_full(self) -> bool:
        """Whether it is time to write them."""
        return self._in_tables + len(self._positions) + len(self.statics) >= _MOST

    def add(self, report: PositionTable | PositionReport | StaticReport) -> None:
        """Add a report, or many."""
        if isinstance(report, PositionTable):
            self._tables.append(report)
            self._in_tables += len(report)
        elif isinstance(report, StaticReport):
            self.statics.append(_static_row(report))
        else:
            self._positions.append(_position_row(report))

    def positions(self) -> Columns:
        """Return the positions as columns of all their rows."""
        columns: Columns = list(map(list, zip(*self._positions, strict=True)))
        if self._tables:
            in_tables = _position_columns(PositionTable.joined(self._tables))
            columns = list(map(list.__add__, columns, in_tables)) if columns else in_tables
        return columns


def _position_row(report: PositionReport) -> Row:
    """In the order of `POSITION_COLUMNS`."""
    return (
        report.mmsi,
        _moment(report.fix_time),
        _moment(report.received_at),
        report.lat_deg,
        report.lon_deg,
        report.sog_kn,
        report.cog_deg,
        report.heading_deg,
        report.rot_deg_min,
        report.message_type,
        report.ais_class,
        report.high_accuracy,
        report.fix_time_source.value,
        cell_of(report.lat_deg, report.lon_deg),
    )


def _position_columns(table: PositionTable) -> Columns:
    """As `_position_row`, many at once, side by side what is near."""
    cells = cells_of(table.lat_deg, table.lon_deg)
    order = np.lexsort((table.fix_us, table.mmsi, cells))
    table = table.chosen(order)
    return [
        table.mmsi.tolist(),
        _moments(table.fix_us),
        _moments(table.received_us),
        table.lat_deg.tolist(),
        table.lon_deg.tolist(),
        table.sog_kn.tolist(),
        table.cog_deg.tolist(),
        table.heading_deg.tolist(),
        table.rot_deg_min.tolist(),
        table.message_type.tolist(),
        table.ais_class.tolist(),
        table.high_accuracy.tolist(),
        list(map(str, table.fix_time_source.tolist())),
        cells[order].tolist(),
    ]


def _static_row(report: StaticReport) -> Row:
    """In the order of `STATIC_COLUMNS`."""
    return (
        report.mmsi,
        _moment(report.received_at),
        printable(report.name, 64),
        printable(report.callsign, 16),
        in_range(report.imo),
        in_range(report.ship_type),
        report.to_bow_m,
        report.to_stern_m,
        report.to_port_m,
        report.to_starboard_m,
        report.mothership_mmsi,
    )


def printable(text: str | None, longest: int) -> str | None:
    """Return what of a text a column of `longest` characters can hold; a table may say anything."""
    if text is None:
        return None
    return "".join(letter for letter in text if letter.isprintable())[:longest] or None


def in_range(value: int | None) -> int | None:
    """Return a number that an integer column can hold, else None."""
    return value if value is None or 0 <= value <= _LARGEST_INTEGER else None


def _moment(moment: datetime) -> str:
    """Write a moment in UTC the way SQLite stores it and Postgres reads it, without its zone."""
    return moment.isoformat(sep=" ", timespec="microseconds")[:26]


def _moments(since_1970_us: IntArray) -> list[str]:
    """As `_moment`, many at once: few seconds differ, and most fractions are milliseconds."""
    seconds, fraction_us = np.divmod(since_1970_us, 1_000_000)
    milliseconds, rest = np.divmod(fraction_us, 1_000)
    if rest.any():
        exact: list[str] = np.datetime_as_string(since_1970_us.view("datetime64[us]")).tolist()
        return [moment.replace("T", " ") for moment in exact]
    distinct, at = np.unique(seconds, return_inverse=True)
    texts: list[str] = np.datetime_as_string(distinct.view("datetime64[s]")).tolist()
    of_second = [text.replace("T", " ") for text in texts]
    return [
        of_second[second] + _MILLISECONDS[millisecond]
        for second, millisecond in zip(at.tolist(), milliseconds.tolist(), strict=True)
    ]
