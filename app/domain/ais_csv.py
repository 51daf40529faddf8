"""AIS from a plain table: one row a position, with the vessel's statics in the same row if known.

    mmsi,time,lat,lon,sog,cog[,heading,rot,to_bow,to_stern,to_port,to_starboard,name,ship_type]

With a header the columns may stand in any order and others are ignored; without one they stand
as above. Units: degrees, knots, degrees per minute, metres; `time` is an ISO date (UTC unless it
says otherwise) or an epoch in seconds. Empty cells and AIS's own "not available" values become
None. A bad row costs that row only, and is named with its line, its column and what to do.
"""

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

from app.domain import ais
from app.domain.accounting import Accounting, MessageReject
from app.domain.nmea_lines import LONGEST_LINE
from app.domain.nmea_times import DISTANT, TimeReader
from app.domain.repeats import RepeatFilter

COLUMNS = (
    "mmsi",
    "time",
    "lat",
    "lon",
    "sog",
    "cog",
    "heading",
    "rot",
    "to_bow",
    "to_stern",
    "to_port",
    "to_starboard",
    "name",
    "ship_type",
)
_REQUIRED = ("mmsi", "time", "lat", "lon")
_MOST_ERRORS = 100


class CsvHeaderError(ValueError):
    """The table lacks a column that no position can do without."""


@dataclass(frozen=True, slots=True)
class RowError:
    """One row that was not taken: its line (from 1), its bucket, the column and the fix."""

    line: int
    reason: MessageReject
    column: str
    message: str


class _RowRejectedError(ValueError):
    def __init__(self, reason: MessageReject, column: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason
        self.column = column


@dataclass(slots=True)
class CsvDecoder:
    """Decodes one table; `errors` keeps its first hundred bad rows, `accounting` counts all."""

    not_after: datetime = DISTANT
    accounting: Accounting = field(default_factory=Accounting)
    errors: list[RowError] = field(default_factory=list)
    _repeats: RepeatFilter = field(default_factory=RepeatFilter)
    _last_statics: dict[int, tuple[object, ...]] = field(default_factory=dict)

    def decode(self, lines: Iterable[str]) -> Iterator[ais.PositionReport | ais.StaticReport]:
        """Yield each row's position, and its statics where they are new.

        Raises:
            CsvHeaderError: a header without mmsi, time, lat or lon.

        """
        columns: dict[str, int] | None = None
        for number, line in enumerate(lines, start=1):
            row = self._cells(line, number)
            if not any(row) or row[0].lstrip().startswith("#"):
                self.accounting.lines.other += 1
            elif columns is None and not row[0].strip().isdigit():
                self.accounting.lines.other += 1
                columns = _header(row)
            else:
                columns = columns or {name: index for index, name in enumerate(COLUMNS)}
                yield from self._row(row, columns, number)

    def _cells(self, line: str, number: int) -> Sequence[str]:
        """Split one line; each is split alone, so that a stray quote costs no other line."""
        try:
            if len(line) <= LONGEST_LINE:
                return next(csv.reader([line]), [])
            problem = f"longer than {LONGEST_LINE} characters"
        except csv.Error as error:
            problem = str(error)
        self._note(number, MessageReject.FIELD, "row", f"this line is no row of a table: {problem}")
        return []

    def _row(
        self, row: Sequence[str], columns: dict[str, int], line: int
    ) -> Iterator[ais.PositionReport | ais.StaticReport]:
        self.accounting.lines.sentence += 1
        self.accounting.sentences.total += 1
        self.accounting.sentences.assembled += 1
        messages = self.accounting.messages
        messages.assembled += 1
        cells = {name: row[at].strip() for name, at in columns.items() if at < len(row)}
        try:
            position = _position(cells, self.not_after)
            static = _static(cells, position)
        except _RowRejectedError as rejected:
            messages.rejected[rejected.reason] += 1
            self._note(line, rejected.reason, rejected.column, str(rejected))
            return
        if self._repeats.is_repeat("\x1f".join(row).encode(), position.received_at):
            messages.duplicates += 1
            return
        messages.positions += 1
        yield position
        if static is not None and self._is_new(static):
            yield static

    def _is_new(self, static: ais.StaticReport) -> bool:
        said = (
            static.name,
            static.ship_type,
            static.to_bow_m,
            static.to_stern_m,
            static.to_port_m,
            static.to_starboard_m,
        )
        if self._last_statics.get(static.mmsi) == said:
            return False
        self._last_statics[static.mmsi] = said
        return True

    def _note(self, line: int, reason: MessageReject, column: str, message: str) -> None:
        if len(self.errors) < _MOST_ERRORS:
            self.errors.append(RowError(line, reason, column, message))


def _header(row: Sequence[str]) -> dict[str, int]:
    names = [cell.strip().lstrip("\ufeff").lower() for cell in row]
    missing = [name for name in _REQUIRED if name not in names]
    if missing:
        msg = (
            f"the table has no column {', '.join(missing)}: its first line must name at least "
            f"{', '.join(_REQUIRED)}, or the columns must be {','.join(COLUMNS)}"
        )
        raise CsvHeaderError(msg)
    return {name: names.index(name) for name in COLUMNS if name in names}


def _position(cells: dict[str, str], not_after: datetime) -> ais.PositionReport:
    mmsi = _whole(cells, "mmsi")
    if mmsi is None or not ais.is_vessel_mmsi(mmsi):
        message = f"{cells.get('mmsi') or 'empty'} is not a vessel's MMSI: 200000000 to 799999999"
        raise _RowRejectedError(MessageReject.MMSI_KIND, "mmsi", message)
    moment = _moment(cells.get("time", ""), not_after)
    lat_deg = _place(cells, "lat", 90.0)
    lon_deg = _place(cells, "lon", 180.0)
    return ais.PositionReport(
        mmsi,
        moment,
        moment,
        lat_deg,
        lon_deg,
        _within(_number(cells, "sog"), 102.3),
        _within(_number(cells, "cog"), 360.0),
        _within(_number(cells, "heading"), 360.0),
        _number(cells, "rot"),
        0,
        None,
        None,
        ais.FixTimeSource.STATED,
    )


def _static(cells: dict[str, str], position: ais.PositionReport) -> ais.StaticReport | None:
    to_bow_m = _distance(cells, "to_bow")
    to_stern_m = _distance(cells, "to_stern")
    to_port_m = _distance(cells, "to_port")
    to_starboard_m = _distance(cells, "to_starboard")
    name = ais.clean_text(cells.get("name", ""))
    ship_type = ais.positive_or_none(_whole(cells, "ship_type") or 0)
    size = ais.antenna_distances_m(to_bow_m, to_stern_m, to_port_m, to_starboard_m)
    if name is None and ship_type is None and size[0] is None:
        return None
    return ais.StaticReport(position.mmsi, position.received_at, name, None, None, ship_type, *size)


def _distance(cells: dict[str, str], name: str) -> float:
    """Return a distance of the antenna, m; an empty cell is AIS's own zero."""
    value = _number(cells, name) or 0.0
    if value < 0:
        raise _RowRejectedError(
            MessageReject.FIELD, name, f"{value} m is negative: give the distance, m"
        )
    return value


def _number(cells: dict[str, str], name: str) -> float | None:
    text = cells.get(name, "")
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _RowRejectedError(
            MessageReject.FIELD, name, f"{text[:40]!r} is no number: give one or leave it empty"
        )
    return value


def _whole(cells: dict[str, str], name: str) -> int | None:
    value = _number(cells, name)
    if value is not None and not value.is_integer():
        raise _RowRejectedError(MessageReject.FIELD, name, f"{value} is not a whole number")
    return None if value is None else int(value)


def _place(cells: dict[str, str], name: str, limit_deg: float) -> float:
    value = _number(cells, name)
    if value is None or abs(value) > limit_deg:
        found = "empty" if value is None else f"{value}"
        raise _RowRejectedError(
            MessageReject.POSITION, name, f"{found}: give degrees within {limit_deg:g}"
        )
    return value


def _within(value: float | None, end: float) -> float | None:
    """Return the value if it lies in [0, end): what is outside means "not available"."""
    return value if value is not None and 0 <= value < end else None


def _moment(text: str, not_after: datetime) -> datetime:
    times = TimeReader(not_after)
    moment = times.epoch(text.encode())
    if moment is None:
        try:
            stated = datetime.fromisoformat(text)
        except ValueError:
            pass
        else:
            moment = times.plausible(stated if stated.tzinfo else stated.replace(tzinfo=UTC))
    if moment is None:
        raise _RowRejectedError(
            MessageReject.TIME,
            "time",
            f"{text[:40]!r} is no plausible time: give an ISO date such as "
            "2024-05-01T12:00:00Z, or an epoch in seconds",
        )
    return moment.astimezone(UTC)
