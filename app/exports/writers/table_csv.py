"""CSV (RFC 4180), one pose a row, safe to open in a spreadsheet.

A text that a spreadsheet would take for a formula gets a leading quote. Numbers are left alone,
also negative ones. A cell is empty where nothing is known.
"""

import csv
import io
from collections.abc import Iterator

from app.exports.writers.flat import COLUMNS, TEXT, Cell, row
from app.exports.writers.records import Source

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
ROWS_AT_ONCE = 500
_TEXTS = tuple(index for index, kind in enumerate(COLUMNS.values()) if kind == TEXT)


def write(source: Source) -> Iterator[bytes]:
    """Give the file in chunks; memory stays small."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for number, pose in enumerate(source.poses(), start=1):
        writer.writerow(_safe(row(pose)))
        if number % ROWS_AT_ONCE == 0:
            yield target.getvalue().encode()
            target.seek(0)
            target.truncate()
    yield target.getvalue().encode()


def _safe(cells: list[Cell]) -> list[Cell]:
    for index in _TEXTS:
        cell = cells[index]
        if isinstance(cell, str) and cell.startswith(FORMULA_STARTS):
            cells[index] = f"'{cell}"
    return cells
