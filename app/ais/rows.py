"""Decoded reports on their way to the database: as many rows as one transaction writes.

Rows of one place and vessel stand together, so that the indexes which lead to a place or a vessel
are written page by page: that is most of the work of storing. Positions stay columns until the
database takes them; a million tuples would keep Python's garbage collector busy.
"""

from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import PositionTable
from app.domain.arrays import FloatArray
from app.domain.cells import HOUR_US, cells_of
from app.domain.nmea_bulk import Decoded
from app.domain.payload_bits import IntArray
from app.domain.static_table import StaticTable

Row = tuple[Any, ...]
Arrays = Mapping[str, npt.NDArray[np.generic]]
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
    "hour",
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
_MOST = 120_000  # a second transaction would write most pages of the indexes again
_LARGEST_INTEGER = 2**31 - 1


class RowBatch:
    """Rows gathered until there are enough for a transaction; they fit into memory."""

    def __init__(self) -> None:
        self._position_tables: list[PositionTable] = []
        self._positions: list[PositionReport] = []
        self._static_tables: list[StaticTable] = []
        self._statics: list[StaticReport] = []
        self._count = 0

    @property
    def is_full(self) -> bool:
        """Whether it is time to write them."""
        return self._count >= _MOST

    def add(self, report: Decoded) -> None:
        """Add a report, or many."""
        if isinstance(report, PositionTable):
            self._position_tables.append(report)
            self._count += len(report)
        elif isinstance(report, StaticTable):
            self._static_tables.append(report)
            self._count += len(report)
        else:
            self._count += 1
            if isinstance(report, StaticReport):
                self._statics.append(report)
            else:
                self._positions.append(report)

    def positions(self) -> PositionTable | None:
        """Return the positions, if any: those of one hour, place and vessel stand together."""
        tables = self._position_tables
        if self._positions:
            tables = [*tables, PositionTable.of(self._positions)]
        if not tables:
            return None
        table = PositionTable.joined(tables)
        cells = cells_of(table.lat_deg, table.lon_deg)
        return table.chosen(np.lexsort((table.fix_us, table.mmsi, cells, table.fix_us // HOUR_US)))

    def static_rows(self) -> list[Row]:
        """Return the static reports as rows: those of one vessel stand together."""
        tables = self._static_tables
        if self._statics:
            tables = [*tables, StaticTable.of(self._statics)]
        if not tables:
            return []
        table = StaticTable.joined(tables)
        return list(_static_rows_of(table.chosen(np.argsort(table.mmsi, kind="stable"))))


def arrays_of(table: PositionTable) -> Arrays:
    """Return `POSITION_COLUMNS` as arrays of numbers.

    Moments are microseconds since 1970; classes, accuracies and sources are places in their lists.
    """
    codes = {"message_type", "ais_class", "high_accuracy", "fix_time_source"}
    arrays: dict[str, npt.NDArray[np.generic]] = {
        name: getattr(table, name).astype(np.uint8) if name in codes else getattr(table, name)
        for name in POSITION_COLUMNS
        if name not in {"fix_time", "received_at", "hour", "cell"}
    }
    arrays["mmsi"] = table.mmsi.astype(np.int32)
    arrays["fix_time"], arrays["received_at"] = table.fix_us, table.received_us
    arrays["hour"] = (table.fix_us // HOUR_US).astype(np.int32)
    arrays["cell"] = cells_of(table.lat_deg, table.lon_deg).astype(np.int32)
    return {name: arrays[name] for name in POSITION_COLUMNS}


def _static_rows_of(table: StaticTable) -> Iterator[Row]:
    """Yield rows in the order of `STATIC_COLUMNS`."""
    return zip(
        table.mmsi.tolist(),
        _texts(_letters(table.received_us)),
        [printable(name, 64) for name in table.name.tolist()],
        [printable(callsign, 16) for callsign in table.callsign.tolist()],
        map(in_range, table.imo.tolist()),
        map(in_range, table.ship_type.tolist()),
        *map(_values, (table.to_bow_m, table.to_stern_m, table.to_port_m, table.to_starboard_m)),
        table.mothership_mmsi.tolist(),
        strict=True,
    )


def _texts(letters: npt.NDArray[np.generic]) -> list[Any]:
    """Return (n, 26) ASCII as texts."""
    texts: list[Any] = letters.view("S26")[:, 0].astype(str).tolist()
    return texts


def _values(column: FloatArray) -> list[Any]:
    """Return numbers, None for NaN."""
    values: list[Any] = np.where(np.isnan(column), None, column.astype(np.object_)).tolist()  # type: ignore[call-overload]  # an array of objects holds it
    return values


def printable(text: str | None, longest: int) -> str | None:
    """Return what of a text a column of `longest` characters can hold; a table may say anything."""
    if text is None or (text.isprintable() and 0 < len(text) <= longest):
        return text
    return "".join(letter for letter in text if letter.isprintable())[:longest] or None


def in_range(value: int | None) -> int | None:
    """Return a number that an integer column can hold, else None."""
    return value if value is None or 0 <= value <= _LARGEST_INTEGER else None


def text_of(moment: datetime) -> str:
    """Write a moment in UTC the way SQLite stores it and Postgres reads it, without its zone."""
    return moment.replace(tzinfo=None).isoformat(" ", "microseconds")


def _letters(since_1970_us: IntArray) -> npt.NDArray[np.uint8]:
    """As `text_of`, many at once, (n, 26) ASCII: few seconds differ."""
    seconds, fraction_us = np.divmod(since_1970_us, 1_000_000)
    distinct, at = np.unique(seconds, return_inverse=True)
    texts = np.datetime_as_string(distinct.view("datetime64[s]")).astype("S19")
    letters = np.empty((seconds.size, 26), dtype=np.uint8)
    letters[:, :19] = texts.view(np.uint8).reshape(-1, 19)[at]
    letters[:, 10], letters[:, 19] = ord(" "), ord(".")
    letters[:, 20:] = ord("0") + fraction_us[:, None] // 10 ** np.arange(6)[::-1] % 10
    return letters
