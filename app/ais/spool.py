"""Decoded rows that wait on the disk until the database's turn comes.

A writing transaction on SQLite keeps all other writers waiting, so decoding has to be over before
it begins; and a year's recording does not fit into memory. Rows therefore wait in a temporary file
as plain tuples, in the order of the columns below and ready for the database driver. Between the
parts of a recording stands a mark, because a fix that two of them tell is one.
"""

import marshal
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from tempfile import SpooledTemporaryFile
from typing import Any, Self

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import PositionTable
from app.domain.payload_bits import IntArray

Row = tuple[Any, ...]
ROWS_IN_A_BATCH = 5_000
_IN_MEMORY_BYTES = 16 << 20
_LENGTH_BYTES = 4
_LARGEST_INTEGER = 2**31 - 1
_END_OF_PART: list[Row] = []
_MILLISECONDS = [f".{millisecond:03}000" for millisecond in range(1000)]


class RowSpool:
    """Rows of one table, written once and then read once: parts of batches of rows."""

    def __init__(self) -> None:
        self._file = SpooledTemporaryFile(_IN_MEMORY_BYTES)  # noqa: SIM115  closed by close()
        self._batch: list[Row] = []

    def add(self, row: Row) -> None:
        """Append a row."""
        self._batch.append(row)
        if len(self._batch) >= ROWS_IN_A_BATCH:
            self._flush()

    def extend(self, rows: Iterable[Row]) -> None:
        """Append rows."""
        self._batch.extend(rows)
        if len(self._batch) >= ROWS_IN_A_BATCH:
            self._flush()

    def end_part(self) -> None:
        """Mark the end of a part."""
        self._flush()
        self._write(_END_OF_PART)

    def parts(self) -> Iterator[Iterator[Sequence[Row]]]:
        """Yield the batches of each ended part, to be read out before the next is asked for."""
        end_bytes = self._file.tell()
        self._file.seek(0)
        while self._file.tell() < end_bytes:
            yield iter(self._read, _END_OF_PART)

    def close(self) -> None:
        """Give the space back."""
        self._file.close()

    def _flush(self) -> None:
        if self._batch:
            self._write(self._batch)
            self._batch = []

    def _write(self, batch: list[Row]) -> None:
        data = marshal.dumps(batch)
        self._file.write(len(data).to_bytes(_LENGTH_BYTES))
        self._file.write(data)

    def _read(self) -> list[Row]:
        header = self._file.read(_LENGTH_BYTES)
        # The bytes are our own, of this process: no foreign data comes this way.
        batch: list[Row] = marshal.loads(self._file.read(int.from_bytes(header)))  # noqa: S302
        return batch


class ReportSpool:
    """The positions and the statics of one recording."""

    def __init__(self) -> None:
        self.positions = RowSpool()
        self.statics = RowSpool()

    def add(self, report: PositionTable | PositionReport | StaticReport) -> None:
        """Append a report, or many."""
        if isinstance(report, PositionTable):
            self.positions.extend(_position_rows(report))
        elif isinstance(report, StaticReport):
            self.statics.add(_static_row(report))
        else:
            self.positions.add(_position_row(report))

    def end_part(self) -> None:
        """Mark the end of a recording's part."""
        self.positions.end_part()
        self.statics.end_part()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.positions.close()
        self.statics.close()


def _position_row(report: PositionReport) -> Row:
    """In the order of `import_repository`'s position columns."""
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
    )


def _position_rows(table: PositionTable) -> Iterator[Row]:
    """As `_position_row`, many at once."""
    return zip(
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
        map(str, table.fix_time_source.tolist()),
        strict=True,
    )


def _static_row(report: StaticReport) -> Row:
    """In the order of `import_repository`'s static columns."""
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
