"""A table of many rows as the bytes of an SQLite database, made by a few steps on whole columns.

Binding a row's values one by one takes SQLite's driver longer than storing the row. But SQLite can
open bytes in memory as a database, and its file format is simple and frozen: a table is a tree of
pages, its leaves hold the rows as they follow each other. Where all rows have columns of the same
width, numpy writes all leaves at once, and one statement then copies them to where they belong.

Source: https://www.sqlite.org/fileformat2.html (sections 1.3, 1.6, 2.1), written anew.
"""

import sqlite3
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]
Column = npt.NDArray[np.generic]

TABLE = "rows"
_PAGE_BYTES = 32_768
_FIRST_ROWID = 1 << 14  # from here to 2^21 a row's number takes three bytes
_MOST_ROWS = 500_000  # their leaves fit below one page
_LEAF, _INNER = 0x0D, 0x05
_LEAF_HEAD_BYTES, _INNER_HEAD_BYTES = 8, 12
_SERIAL_TYPES = {"u1": 1, "i4": 4, "i8": 6, "f8": 7}  # how SQLite tells of a value what it is


def database_image(columns: Mapping[str, Column]) -> bytes:
    """Return a database with a table `TABLE` of these columns.

    Columns: uint8 below 128, int32, int64 and float64, NaN for none; all of the same length, one
    row or more. Raises ValueError for more rows than a tree of two levels holds.
    """
    cells = _cells(list(columns.values()))
    rows, cell_bytes = cells.shape
    if rows > _MOST_ROWS:
        raise ValueError(f"{rows} rows are too many for a tree of two levels")
    per_page = (_PAGE_BYTES - _LEAF_HEAD_BYTES) // (cell_bytes + 2)
    leaves = -(-rows // per_page)
    room = np.zeros((leaves * per_page, cell_bytes), dtype=np.uint8)
    room[:rows] = cells
    counts = np.full(leaves, per_page)
    counts[-1] = rows - (leaves - 1) * per_page
    start = _PAGE_BYTES - per_page * cell_bytes
    pages = np.zeros((leaves, _PAGE_BYTES), dtype=np.uint8)
    pages[:, 0] = _LEAF
    pages[:, 3:5] = _big_endian(counts, ">u2")
    pages[:, 5:7] = _big_endian(np.array([start]), ">u2")
    pages[:, start:] = room.reshape(leaves, -1)
    pointers = _big_endian(start + cell_bytes * np.arange(per_page), ">u2")
    pages[:, _LEAF_HEAD_BYTES : _LEAF_HEAD_BYTES + 2 * per_page] = pointers.ravel()
    head = bytearray(_empty(list(columns))[:_PAGE_BYTES])
    if leaves == 1:  # it is the root itself
        return bytes(head) + pages.tobytes()
    head[28:32] = (2 + leaves).to_bytes(4)
    ends = _FIRST_ROWID + np.arange(1, leaves) * per_page - 1
    return bytes(head) + _root(ends, leaves).tobytes() + pages.tobytes()


def _cells(columns: list[Column]) -> Bytes:
    """Return each row as it stands in a leaf: its length, its number, what its columns are, them.

    The length takes two bytes, the number three, seven bits each.
    """
    kinds, values = zip(*map(_kind_and_bytes, columns), strict=True)
    head = np.array([1 + len(kinds), *kinds], dtype=np.uint8)
    body = np.concatenate(values, axis=1)
    rows, length = len(body), head.size + body.shape[1]
    lengths = np.tile(np.array([0x80 | length >> 7, length & 0x7F], dtype=np.uint8), (rows, 1))
    numbers = _varints(_FIRST_ROWID + np.arange(rows))
    return np.concatenate([lengths, numbers, np.tile(head, (rows, 1)), body], axis=1)


def _kind_and_bytes(column: Column) -> tuple[int, Bytes]:
    dtype = column.dtype.str[1:]
    return _SERIAL_TYPES[dtype], _big_endian(column, f">{dtype}")


def _root(ends: npt.NDArray[np.int64], leaves: int) -> Bytes:
    """Return the page above the leaves: of each but the last its page and its last row."""
    page = np.zeros(_PAGE_BYTES, dtype=np.uint8)
    cells = np.concatenate([_big_endian(3 + np.arange(leaves - 1), ">u4"), _varints(ends)], axis=1)
    start = _PAGE_BYTES - cells.size
    page[0] = _INNER
    page[3:5] = _big_endian(np.array([leaves - 1]), ">u2")
    page[5:7] = _big_endian(np.array([start]), ">u2")
    page[8:12] = _big_endian(np.array([2 + leaves]), ">u4")
    pointers = _big_endian(start + cells.shape[1] * np.arange(leaves - 1), ">u2")
    page[_INNER_HEAD_BYTES : _INNER_HEAD_BYTES + pointers.size] = pointers.ravel()
    page[start:] = cells.ravel()
    return page


def _varints(numbers: npt.NDArray[np.int64]) -> Bytes:
    """Return numbers from 2^14 to 2^21 as SQLite's integers of three bytes."""
    parts = (0x80 | numbers >> 14, 0x80 | numbers >> 7 & 0x7F, numbers & 0x7F)
    return np.stack(parts, axis=1).astype(np.uint8)


def _big_endian(values: Column, dtype: str) -> Bytes:
    return np.ascontiguousarray(values.astype(dtype)).view(np.uint8).reshape(values.size, -1)


def _empty(names: list[str]) -> bytes:
    """Return a database whose table has no rows yet: two pages, the second its root."""
    connection = sqlite3.connect(":memory:")
    connection.execute(f"PRAGMA page_size = {_PAGE_BYTES}")
    connection.execute(f"CREATE TABLE {TABLE} ({', '.join(names)})")
    image = connection.serialize()
    connection.close()
    return image
