"""Keypoints as a table: pasted or uploaded CSV, a line a keypoint.

Columns `name,u_px,v_px,lat_deg,lon_deg,height_m[,role]`, in that order or as a header line says;
separated by commas, semicolons or tabs, as spreadsheets write them.
"""

import csv
from typing import Any

from pydantic import ValidationError

from app.errors import FieldError, Invalid
from app.registration.schemas import KeypointIn

COLUMNS = ("name", "u_px", "v_px", "lat_deg", "lon_deg", "height_m", "role")
FIELD = "table"


def parse_table(text: str) -> list[KeypointIn]:
    """Return the keypoints of a table. Raises Invalid naming the line and the column."""
    lines = [
        (number, line)
        for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    if not lines:
        raise Invalid.field(FIELD, f"is empty; give lines of {','.join(COLUMNS)}")
    separator = max(",;\t", key=lines[0][1].count)
    rows = [(number, next(csv.reader([line], delimiter=separator))) for number, line in lines]
    columns = [cell.strip().lower() for cell in rows[0][1]]
    if "u_px" in columns:
        rows = rows[1:]
        _check_columns(columns)
    else:
        columns = list(COLUMNS)
    return [_keypoint(number, columns, cells) for number, cells in rows]


def _check_columns(columns: list[str]) -> None:
    unknown = [column for column in columns if column not in COLUMNS]
    if unknown or "v_px" not in columns or "name" not in columns:
        found = ", ".join(columns)
        raise Invalid.field(FIELD, f"knows the columns {', '.join(COLUMNS)}; line 1 has {found}")


def _keypoint(number: int, columns: list[str], cells: list[str]) -> KeypointIn:
    if len(cells) > len(columns):
        raise Invalid.field(
            FIELD, f"line {number} has {len(cells)} columns, at most {len(columns)} are known"
        )
    values: dict[str, Any] = {
        column: cell.strip() for column, cell in zip(columns, cells, strict=False) if cell.strip()
    }
    try:
        return KeypointIn.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        column = ".".join(str(step) for step in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        wrong = f"line {number}{', ' + column if column else ''}: {message}"
        raise Invalid(wrong, fields=(FieldError(FIELD, wrong),)) from error


def write_table(keypoints: list[dict[str, Any]]) -> str:
    """Return keypoints as such a table, with its header."""
    lines = [",".join(COLUMNS)]
    for point in keypoints:
        cells = [str(point[column]) for column in COLUMNS]
        name = cells[0].replace('"', '""')
        lines.append(",".join([f'"{name}"' if any(c in name for c in ',"') else name, *cells[1:]]))
    return "\n".join(lines) + "\n"
