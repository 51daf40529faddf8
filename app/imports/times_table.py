"""When photographs were taken, by a table that somebody made: names of files, and times.

Spreadsheets part columns by commas, semicolons or tabs, call them as they like, write times in
their country's way and keep the folders of another machine in the names. What can be read in one
way only is read; what could mean two moments is refused with its line, because a person can tell.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain.date_order import first_told, is_date, is_unsure
from app.domain.table_cells import read_compact, read_date
from app.domain.table_mapping import TimeFormat
from app.domain.table_proposal import is_comment, split_row_or_nothing
from app.errors import Invalid

_FIELD = "times"
_FILE_NAMES = frozenset(
    re.findall(
        r"\w+",
        "file filename filepath name path image imagename imagefile imagepath photo photograph "
        "picture img src source relativepath datei dateiname dateipfad bild bildname foto",
    )
)
_TIME_NAMES = frozenset(
    re.findall(
        r"\w+",
        "time timestamp datetime datetimeoriginal capturedat captured capturetime takenat taken "
        "datetaken timetaken acquisitiontime moment utc epoch unixtime zeit zeitpunkt zeitstempel "
        "aufnahmezeit date datum day tag",
    )
)
_DAY_NAMES = frozenset({"date", "datum", "day", "tag", "datetaken"})
_EPOCH = re.compile(r"(\d{10})(?:[.,](\d{1,6})\d*|(\d{3}))?")
_EXIF_DAY = re.compile(r"(\d{4})[:/.](\d{2})[:/.](\d{2})(?=[ T])")
_CLOCK = re.compile(
    r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?: ?[AaPp][Mm])?(?: ?Z|[+-]\d{2}:?\d{2})?"
)
_DAY_ALONE = re.compile(r"\d{8}|\d{1,4}[./-]\w{1,3}[./-]\d{1,4}")
_ENDING = re.compile(r"\.[A-Za-z]{3,4}$")
_EXAMPLE = "give one such as 2026-07-01 10:11:12"


@dataclass(frozen=True, slots=True)
class _Columns:
    """Which columns hold the name, the time and (or None) its clock; `is_utc`: so it is called."""

    name: int
    time: int
    clock: int | None = None
    is_utc: bool = False

    def time_in(self, cells: Sequence[str]) -> str:
        """Return what a row says of its time."""
        if self.clock is None or self.clock >= len(cells):
            return cells[self.time]
        return f"{cells[self.time]} {cells[self.clock]}".strip()


def read_times(text: str) -> dict[str, datetime]:
    """Return moments by names of files, naive where the table tells no zone.

    Folders in names are parted by slashes. Raises Invalid naming the line that cannot be read, or
    that says another time of a name than a line before.
    """
    lines = [
        (number, line)
        for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1)
        if not is_comment(line)
    ]
    delimiter = _delimiter([line for _, line in lines[:50]])
    rows = [(number, split_row_or_nothing(line, delimiter)) for number, line in lines]
    if not rows:
        raise Invalid.field(_FIELD, "the table is empty; it needs two columns: file name, time")
    for number, cells in rows:
        if len(cells) < 2:
            raise Invalid.field(_FIELD, f"line {number} needs two columns: file name, time")
    has_header = not any(_looks_like_time(cell) for cell in rows[0][1])
    header = rows[0][1] if has_header and len(rows) > 1 else []
    rows = rows[1:] if header else rows
    columns = _columns(header, rows[0][1])
    return _read(rows, columns)


def _read(rows: Sequence[tuple[int, list[str]]], columns: _Columns) -> dict[str, datetime]:
    needed = max(columns.name, columns.time)
    order = first_told(columns.time_in(cells) for _, cells in rows if len(cells) > needed)
    listed: dict[str, datetime] = {}
    lines: dict[str, int] = {}
    for number, cells in rows:
        if len(cells) <= needed:
            raise Invalid.field(_FIELD, f"line {number} has fewer columns than the first")
        name = _tidy(cells[columns.name])
        moment = _moment(columns.time_in(cells), order, number)
        if columns.is_utc and moment.tzinfo is None:
            moment = moment.replace(tzinfo=UTC)
        if listed.setdefault(name, moment) != moment:
            raise Invalid.field(
                _FIELD, f"line {number}: {name[:80]!r} has another time in line {lines[name]}"
            )
        lines.setdefault(name, number)
    return listed


def matched(listed: Mapping[str, datetime], paths: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the path of a file and the listed name that means it, for those that are listed.

    The name that shares most folders with the path; letters' case and a missing ending do not
    matter. Where two names share as many, none is meant.
    """
    by_name: dict[str, list[str]] = defaultdict(list)
    for name in listed:
        by_name[name.rpartition("/")[2].casefold()].append(name)
    for path in paths:
        base = path.rpartition("/")[2].casefold()
        found = by_name.get(base) or by_name.get(base.rpartition(".")[0], [])
        shared = sorted(((_shared(name, path), name) for name in found), reverse=True)
        if not shared or shared[0][0] < 0:
            continue
        is_clear = len(shared) == 1 or shared[0][0] > shared[1][0]
        if is_clear or listed[shared[0][1]] == listed[shared[1][1]]:
            yield path, shared[0][1]


def _shared(name: str, path: str) -> int:
    """Count the folders that end both, or -1 where their folders contradict each other."""
    ours, theirs = (
        [part.casefold() for part in reversed(text.split("/")[:-1])] for text in (name, path)
    )
    same = 0
    for mine, other in zip(ours, theirs, strict=False):
        if mine != other:
            return -1
        same += 1
    return same


def _delimiter(lines: Sequence[str]) -> str:
    """Return what parts the columns: what every line has, commas last."""
    for delimiter in ("\t", ";", "|"):
        if lines and all(delimiter in line for line in lines):
            return delimiter
    return ","


def _columns(header: Sequence[str], cells: Sequence[str]) -> _Columns:
    """Tell columns by their names, else by what the first row holds."""
    names = [re.sub(r"[^a-zäöü]", "", cell.casefold()) for cell in header]
    plain = [name.removesuffix("utc") or "utc" for name in names]
    times = [at for at, name in enumerate(plain) if name in _TIME_NAMES]
    files = [at for at, name in enumerate(plain) if name in _FILE_NAMES]
    times = times or [at for at, cell in enumerate(cells) if _looks_like_time(cell)]
    if len(times) == len(cells):  # cameras name files after the time: the name stands first
        times = times[1:]
    if not times:
        shown = ", ".join(header or cells)[:80]
        raise Invalid.field(_FIELD, f"no column of {shown!r} is a time; {_EXAMPLE}")
    days = [at for at in times if plain and plain[at] in _DAY_NAMES]
    clocks = [at for at in times if at < len(cells) and _CLOCK.fullmatch(cells[at])]
    time, clock = times[0], None
    if clocks and days and days[0] != clocks[0]:
        time, clock = days[0], clocks[0]
    elif not header and clocks and clocks[0] > 0 and clocks[0] - 1 in times:
        time, clock = clocks[0] - 1, clocks[0]
    rest = [at for at in range(len(cells)) if at not in (time, clock)]
    endings = [at for at in rest if _ENDING.search(cells[at])]
    files = [at for at in files if at in rest] or endings or rest
    is_utc = any(names[at].endswith("utc") for at in (time, clock) if at is not None and names)
    return _Columns(files[0], time, clock, is_utc)


def _looks_like_time(cell: str) -> bool:
    day = cell.partition(" ")[0]
    if _CLOCK.fullmatch(cell) or _EPOCH.fullmatch(cell) or is_date(cell) or is_date(day):
        return True
    return _plain(cell) is not None


def _plain(text: str) -> datetime | None:
    """Read a time that can be meant in one way only."""
    if match := _EPOCH.fullmatch(text):
        fraction = (match[2] or match[3] or "0").ljust(6, "0")
        return datetime.fromtimestamp(int(match[1]), UTC).replace(microsecond=int(fraction))
    text = re.sub(r" ?(?:UTC|GMT)$", "Z", text)
    for read in (datetime.fromisoformat, read_compact):
        try:
            return read(_EXIF_DAY.sub(r"\1-\2-\3", text))
        except ValueError:
            continue
    return None


def _moment(text: str, order: TimeFormat | None, line: int) -> datetime:
    if is_unsure(text) and order is None:
        raise Invalid.field(
            _FIELD,
            f"line {line}: {text[:40]!r} may have the day or the month first; write 2026-04-03",
        )
    if _DAY_ALONE.fullmatch(text):
        raise Invalid.field(_FIELD, f"line {line}: {text!r} is a day without a time; {_EXAMPLE}")
    found: datetime | None
    try:
        found = read_date(text, day_first=order is not TimeFormat.MONTH_FIRST)
    except ValueError:
        found = _plain(text)
    if found is None:
        raise Invalid.field(_FIELD, f"line {line}: {text[:40]!r} is no time; {_EXAMPLE}")
    return found


def _tidy(name: str) -> str:
    """Return a file's name with slashes, without drive and leading dots."""
    parts = name.replace("\\", "/").split("/")
    return "/".join(part for part in parts if part not in ("", ".") and not part.endswith(":"))
