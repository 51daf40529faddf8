"""Positions as the bytes of Postgres's binary COPY, made by a few steps on whole columns.

Writing numbers and moments as text takes us longer than decoding them took, and the server has to
read them again. The binary form of a row is simple and stable: how many fields it has, and of each
its length and its bytes, big-endian; what is empty has the length -1 and no bytes. So numpy writes
all rows as if nothing were empty, and then leaves out what is.

Source: https://www.postgresql.org/docs/current/sql-copy.html (binary format), written anew.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from app.ais.rows import POSITION_COLUMNS
from app.domain.ais_bulk import ACCURACIES, AIS_CLASSES, SOURCES, PositionTable
from app.domain.cells import HOUR_US, cells_of
from app.domain.payload_bits import IntArray

Bytes = npt.NDArray[np.uint8]

_HEADER = b"PGCOPY\n\xff\r\n\0" + bytes(8)  # no flags, nothing more to say
_TRAILER = b"\xff\xff"
_2000_US = 946_684_800_000_000  # Postgres counts from there
_ROWS_AT_ONCE = 20_000
_EMPTY = -1


class _Field(NamedTuple):
    """A column: (rows, most bytes) of bytes, and how many of them each row has, -1 for none."""

    text: Bytes
    lengths: IntArray


class _Words:
    """A column of few different words, told by their place among them."""

    def __init__(self, words: Sequence[str | bytes | None]) -> None:
        told = [word.encode() if isinstance(word, str) else word or b"" for word in words]
        widest = max(map(len, told))
        padded = b"".join(word.ljust(widest, b"\0") for word in told)
        self._text = np.frombuffer(padded, dtype=np.uint8).reshape(-1, widest)
        self._lengths = np.array([len(word) or _EMPTY for word in told])

    def field(self, places: IntArray) -> _Field:
        """Return the words at some places."""
        return _Field(self._text[places], self._lengths[places])


_WORDS = {
    "ais_class": _Words(AIS_CLASSES),
    "high_accuracy": _Words([None if known is None else bytes([known]) for known in ACCURACIES]),
    "fix_time_source": _Words([source.value for source in SOURCES]),
}


def copy_of(table: PositionTable, site_id: int | None, file_id: int) -> Iterator[bytes]:
    """Yield what COPY reads: `POSITION_COLUMNS`, `site_id` and `file_id` of all rows."""
    yield _HEADER
    for start in range(0, len(table), _ROWS_AT_ONCE):
        some = table.chosen(np.arange(start, min(start + _ROWS_AT_ONCE, len(table))))
        fields = [_field(some, name) for name in POSITION_COLUMNS]
        site = np.full(len(some), np.nan if site_id is None else site_id)
        file = np.full(len(some), file_id)
        yield _rows([*fields, _number(site, ">i4"), _number(file, ">i4")])
    yield _TRAILER


def _field(table: PositionTable, name: str) -> _Field:
    if name in _WORDS:
        return _WORDS[name].field(getattr(table, name))
    if name == "fix_time":
        return _number(table.fix_us - _2000_US, ">i8")
    if name == "received_at":
        return _number(table.received_us - _2000_US, ">i8")
    if name == "hour":
        return _number(table.fix_us // HOUR_US, ">i4")
    if name == "cell":
        return _number(cells_of(table.lat_deg, table.lon_deg), ">i4")
    column = getattr(table, name)
    return _number(column, ">f8" if column.dtype == np.float64 else ">i4")


def _number(column: npt.NDArray[np.generic], dtype: str) -> _Field:
    """Return a column of numbers; NaN is empty."""
    is_float = column.dtype == np.float64
    is_empty = np.isnan(column) if is_float else np.full(column.size, False)
    values = np.where(is_empty, 0, column).astype(dtype)
    width = values.dtype.itemsize
    return _Field(values.view(np.uint8).reshape(-1, width), np.where(is_empty, _EMPTY, width))


def _rows(fields: Sequence[_Field]) -> bytes:
    rows = len(fields[0].text)
    count = np.full((rows, 2), [0, len(fields)], dtype=np.uint8)
    columns, is_there = [count], [np.full((rows, 2), True)]
    for field in fields:
        columns += [field.lengths.astype(">i4").view(np.uint8).reshape(-1, 4), field.text]
        widest = np.arange(field.text.shape[1])
        is_there += [np.full((rows, 4), True), widest < field.lengths[:, None]]
    text: bytes = np.concatenate(columns, axis=1)[np.concatenate(is_there, axis=1)].tobytes()
    return text
