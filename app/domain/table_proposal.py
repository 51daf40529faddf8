"""What a table seems to be: a mapping proposed from its header and its first values.

Names come first, because archives keep theirs. Where they say nothing, values do: nine digits that
begin with 2 to 7 are an MMSI, two columns of decimals within 90 and 180 degrees a place. What was
guessed, and what could be read in two ways, is told, so that a person can look at it.
"""

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from app.domain.date_order import is_date, is_unsure, told_order
from app.domain.nmea_times import DISTANT
from app.domain.table_cells import CellReader
from app.domain.table_mapping import COLUMNS, DELIMITERS, REQUIRED, TableMapping, TimeFormat
from app.domain.table_names import meanings, speed_unit

SAMPLE_ROWS = 50
_MMSI = re.compile(r"\d{9}")
_MOST = 2 / 3  # of a column's cells tell what it holds; a few may say "not available"
_NUMBER = re.compile(r"-?\d+(?:[.,]\d+)?")
_DECIMAL = re.compile(r"-?\d{1,3}[.,]\d+")
_DECIMAL_COMMA = re.compile(r"-?\d+,\d+")
_SEPARATOR = re.compile(r'"?sep=.?"?', re.IGNORECASE)
_FOURTEEN = re.compile(r"\d{14}(?:\.\d+)?Z?|\d{8}[ T_-]\d{6}Z?")
DANISH = "Danish Maritime Authority"  # writes the day first, always
_SIDES_DOUBT = (
    "C is read as the distance to port and D to starboard, as AIS has them; the archive's own "
    "description says the opposite. Swap them if a ship's antenna is known to be on the other side."
)
_KINDS = (
    ({"timestamp", "type of mobile"}, DANISH),
    ({"basedatetime"}, "MarineCadastre"),
    ({"base_date_time"}, "MarineCadastre"),
)


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mapping, the header's names (empty without one) and rows to look at, and what is unsure.

    `unsure_date` is a date that may have the day or the month first, where none of these rows
    tells which; else empty.
    """

    mapping: TableMapping
    kind: str
    header: list[str]
    rows: list[list[str]]
    doubts: list[str]
    unsure_date: str = ""


def split_row(line: str, delimiter: str) -> list[str]:
    """Split one line into cells. Raises csv.Error for what is no row."""
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def is_comment(line: str) -> bool:
    """Whether a line of a table holds no row: blank, a remark behind `#`, or Excel's `sep=;`."""
    start = line.lstrip("\ufeff \t")
    return not start.strip() or start.startswith("#") or bool(_SEPARATOR.fullmatch(start.strip()))


def is_header(line: str) -> bool:
    """Whether a line names columns although it begins as a remark does (`# Timestamp,...`)."""
    names = split_row_or_nothing(line.lstrip("\ufeff# \t"), delimiter_of([line]))
    return {"mmsi", "time"} <= meanings(names).keys()


def split_row_or_nothing(line: str, delimiter: str) -> list[str]:
    """Split a line of unknown worth: nothing for what is no row."""
    try:
        return split_row(line, delimiter)
    except csv.Error:
        return []


def delimiter_of(lines: Sequence[str]) -> str:
    """Return what parts the columns: what gives all lines four or more, commas last."""
    for delimiter in (";", "\t", "|"):
        counts = [line.count(delimiter) for line in lines]
        if counts and min(counts) >= len(REQUIRED) - 1:
            return delimiter
    return DELIMITERS[0]


def propose(lines: Sequence[str], delimiter: str | None = None) -> Proposal:
    """Propose how to read a table from its first lines, parted by a delimiter if it is known.

    The mapping may lack required columns: see `TableMapping.missing`.
    """
    head = [line for line in lines if not is_comment(line) or is_header(line)][: SAMPLE_ROWS + 1]
    delimiter = delimiter or delimiter_of(head)
    rows = [split_row_or_nothing(line.lstrip("\ufeff"), delimiter) for line in head]
    header: list[str] = []
    if rows and not any(_NUMBER.fullmatch(cell) for cell in rows[0]):
        header, rows = [cell.lstrip("# ") for cell in rows[0]], rows[1:]
    doubts: list[str] = []
    columns = meanings(header) if header else _plain_order(rows)
    columns |= _by_values(columns, rows, header, doubts)
    kind = _kind(header)
    if kind == DANISH and "to_starboard" in columns:
        doubts.append(_SIDES_DOUBT)
    texts = times_of(columns, rows)
    time_format, unsure_date = _time_format(texts)
    if kind == DANISH:
        unsure_date = ""
    mapping = TableMapping(
        columns,
        has_header=bool(header),
        delimiter=delimiter,
        decimal="," if _has_commas(columns, rows) else ".",  # parted by commas, they are quoted
        time_format=time_format,
        speed_unit=speed_unit(header, columns.get("sog") if header else None),
    )
    return Proposal(mapping, kind, header, rows, doubts, unsure_date)


def times_of(columns: Mapping[str, int], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield how rows write their times, where they have one."""
    index, clock = columns.get("time"), columns.get("clock")
    if index is None:
        return
    for row in rows:
        if index < len(row) and row[index] and (clock is None or clock < len(row)):
            yield row[index] if clock is None else f"{row[index]} {row[clock]}"


def _kind(header: Sequence[str]) -> str:
    names = {name.lower() for name in header}
    for marks, kind in _KINDS:
        if marks <= names:
            return kind
    return "plain" if names and names <= set(COLUMNS) else "table"


def _plain_order(rows: Sequence[Sequence[str]]) -> dict[str, int]:
    """Return the order of a plain table if its first columns can be an MMSI and a place."""
    is_plain = bool(rows) and all(
        len(row) >= len(REQUIRED)
        and row[0].isdigit()
        and all(_NUMBER.fullmatch(row[index]) or not row[index] for index in (2, 3))
        for row in rows[:1]
    )
    width = max(map(len, rows), default=0)
    return {name: index for index, name in enumerate(COLUMNS) if index < width} if is_plain else {}


def _by_values(
    known: dict[str, int],
    rows: Sequence[Sequence[str]],
    header: Sequence[str],
    doubts: list[str],
) -> dict[str, int]:
    """Return columns for the required fields that no name told, as far as values tell."""
    found: dict[str, int] = {}
    width = len(header) or max(map(len, rows), default=0)
    tests: dict[str, Callable[[str], bool]] = {
        "mmsi": lambda cell: bool(_MMSI.fullmatch(cell)),
        "time": _is_time,
        "lat": lambda cell: _is_place(cell, 91),  # of which 91 and 181 are "not available"
        "lon": lambda cell: _is_place(cell, 181),
    }
    for field, fits in tests.items():
        if field in known or (field == "lon" and "lat" not in {*known, *found}):
            continue
        taken = {*known.values(), *found.values()}
        for index in range(width):
            cells = [row[index] for row in rows if index < len(row) and row[index]]
            if index not in taken and cells and sum(map(fits, cells)) >= _MOST * len(cells):
                found[field] = index
                name = f" ({header[index]})" if index < len(header) and header[index] else ""
                doubts.append(f"Column {index + 1}{name} is taken as {field} by its values.")
                break
    return found


def _is_time(cell: str) -> bool:
    return any(
        _readable([cell], TableMapping({"time": 0}, time_format=each)) for each in TimeFormat
    )


def _is_place(cell: str, limit_deg: float) -> bool:
    return bool(_DECIMAL.fullmatch(cell)) and abs(float(cell.replace(",", "."))) <= limit_deg


def _has_commas(columns: dict[str, int], rows: Sequence[Sequence[str]]) -> bool:
    places = [columns[name] for name in ("lat", "lon") if name in columns]
    return any(
        _DECIMAL_COMMA.fullmatch(row[index]) for row in rows for index in places if index < len(row)
    )


def _time_format(times: Iterable[str]) -> tuple[TimeFormat, str]:
    """Return how times are written, and one that may be meant otherwise where all may."""
    texts = list(times)
    if texts and all(map(_FOURTEEN.fullmatch, texts)):
        return TimeFormat.COMPACT, ""
    dates = list(filter(is_date, texts))
    if not dates or len(dates) < len(texts) / 2:
        return TimeFormat.ISO, ""
    told = set(map(told_order, dates))
    for order in (TimeFormat.DAY_FIRST, TimeFormat.MONTH_FIRST):
        if order in told:
            return order, ""
    return TimeFormat.DAY_FIRST, next(filter(is_unsure, dates), "")


def _readable(texts: Sequence[str], mapping: TableMapping) -> bool:
    reader = CellReader(mapping, DISTANT)
    try:
        return all(isinstance(reader.moment({"time": text}), datetime) for text in texts)
    except ValueError:
        return False
