"""Keypoints and landmarks as tables: pasted or uploaded CSV, a line each.

Columns `name,u_px,v_px,lat_deg,lon_deg,height_m[,role]` (landmarks without u_px, v_px and role), in
that order or as a header line says; separated by commas, semicolons or tabs, as spreadsheets write
them. Where commas do not separate, they may stand for the decimal point.
"""

import csv
import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from app.errors import FieldError, Invalid
from app.registration.landmark_schemas import LandmarkIn
from app.registration.schemas import KeypointIn

COLUMNS = ("name", "u_px", "v_px", "lat_deg", "lon_deg", "height_m", "role")
LANDMARK_COLUMNS = ("name", "lat_deg", "lon_deg", "height_m")
FIELD = "table"
_NUMBERS = frozenset({"u_px", "v_px", "height_m"})  # angles read both kinds by themselves
_FORMULA = re.compile(r"'*[=+\-@\t\r]")
Model = TypeVar("Model", bound=BaseModel)


def parse_table(text: str) -> list[KeypointIn]:
    """Return the keypoints of a table. Raises Invalid naming the line and the column."""
    return _parsed(text, KeypointIn, COLUMNS, {"name", "u_px", "v_px"})


def parse_landmarks(text: str) -> list[LandmarkIn]:
    """Return the landmarks of a table. Raises Invalid naming the line and the column."""
    return _parsed(text, LandmarkIn, LANDMARK_COLUMNS, set(LANDMARK_COLUMNS))


def write_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = COLUMNS) -> str:
    """Return keypoints (or landmarks) as such a table, with its header."""
    lines = [",".join(columns)]
    for row in rows:
        cells = [str(row[column]) for column in columns]
        name = _shielded(cells[0]).replace('"', '""')
        lines.append(",".join([f'"{name}"' if any(c in name for c in ',;"') else name, *cells[1:]]))
    return "\n".join(lines) + "\n"


def _shielded(name: str) -> str:
    """Keep spreadsheets from taking a name for a formula; `_bared` takes the quote off again."""
    return f"'{name}" if _FORMULA.match(name) else name


def _bared(name: str) -> str:
    return name[1:] if name.startswith("'") and _FORMULA.match(name[1:]) else name


def _parsed(text: str, model: type[Model], known: Sequence[str], needed: set[str]) -> list[Model]:
    lines = [
        (number, line)
        for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    if not lines:
        raise Invalid.field(FIELD, f"is empty; give lines of {','.join(known)}")
    separator = _separator(lines[0][1])
    rows = [(number, next(csv.reader([line], delimiter=separator))) for number, line in lines]
    columns = [cell.strip().lower() for cell in rows[0][1]]
    if "lat_deg" in columns or "u_px" in columns:
        rows = rows[1:]
        _check_columns(columns, known, needed)
    else:
        columns = list(known)
    return [_row(number, model, columns, cells, separator) for number, cells in rows]


def _separator(line: str) -> str:
    """Tell a table's separator; commas beside semicolons or tabs are decimal ones."""
    outside = "".join(line.split('"')[::2])
    return next((mark for mark in ";\t" if outside.count(mark) >= 2), ",")


def _check_columns(columns: list[str], known: Sequence[str], needed: set[str]) -> None:
    unknown = [column for column in columns if column not in known]
    if unknown or not needed <= set(columns):
        found = ", ".join(columns)
        raise Invalid.field(FIELD, f"knows the columns {', '.join(known)}; line 1 has {found}")


def _row(
    number: int, model: type[Model], columns: list[str], cells: list[str], separator: str
) -> Model:
    if len(cells) > len(columns):
        hint = "; decimal commas need semicolons between the columns" if separator == "," else ""
        raise Invalid.field(
            FIELD, f"line {number} has {len(cells)} columns, at most {len(columns)} are known{hint}"
        )
    values: dict[str, Any] = {
        column: cell.strip() for column, cell in zip(columns, cells, strict=False) if cell.strip()
    }
    if "name" in values:
        values["name"] = _bared(values["name"])
    if separator != ",":
        for column in _NUMBERS & values.keys():
            values[column] = values[column].replace(",", ".")
    try:
        return model.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        column = ".".join(str(step) for step in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        wrong = f"line {number}{', ' + column if column else ''}: {message}"
        raise Invalid(wrong, fields=(FieldError(FIELD, wrong),)) from error
