"""Figures as a CSV table, for a spreadsheet or a paper.

Text that a spreadsheet would take for a formula gets a leading quote; numbers stay numbers, also
negative ones. An empty cell is a figure that is not defined, never a 0.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from enum import StrEnum

from fastapi import Response

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")


class TableFormat(StrEnum):
    """How figures are told."""

    JSON = "json"
    CSV = "csv"


def csv_response(
    name: str, columns: Sequence[str], rows: Sequence[Mapping[str, object]]
) -> Response:
    """Return a CSV file; each row gives its cells by column, missing ones stay empty."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\r\n")
    writer.writerow(columns)
    writer.writerows([_cell(row.get(column)) for column in columns] for row in rows)
    return Response(
        target.getvalue(),
        media_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="{name}.csv"'},
    )


def _cell(value: object) -> object:
    if isinstance(value, str) and value.startswith(FORMULA_STARTS):
        return f"'{value}"
    return "" if value is None else value
