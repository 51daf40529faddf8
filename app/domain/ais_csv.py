"""AIS from a table: one row a position, with the vessel's statics in the same row if known.

    mmsi,time,lat,lon,sog,cog[,heading,rot,to_bow,to_stern,to_port,to_starboard,name,ship_type]

is a plain one; others are read by a mapping, which is proposed from their header and values where
none is given. Units: degrees, knots, degrees per minute, metres. A table that knows only length
and width gives a hull whose reference point is unknown: A = C = 0, as transponders say it. A bad
row costs that row only, and is named with its line, its column and what to do.
"""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from datetime import datetime
from itertools import chain, islice

from app.domain import ais
from app.domain.accounting import Accounting, MessageReject
from app.domain.nmea_lines import LONGEST_LINE
from app.domain.nmea_times import DISTANT
from app.domain.rejects import RejectLog
from app.domain.repeats import RepeatFilter
from app.domain.table_cells import CellReader, Cells, RowRejectedError, within
from app.domain.table_mapping import COLUMNS, REQUIRED, TableMapping
from app.domain.table_names import SHIP_TYPE_WORDS
from app.domain.table_proposal import (
    SAMPLE_ROWS,
    is_comment,
    is_header,
    propose,
    split_row,
)

_MOST_ERRORS = 100
_MOST_VESSELS = 200_000  # whose last statics are remembered
_HEAD_LINES = 4 * SAMPLE_ROWS

Reports = tuple[ais.PositionReport | ais.StaticReport, ...]


class CsvHeaderError(ValueError):
    """The table lacks a column that no position can do without."""


@dataclass(frozen=True, slots=True)
class RowError:
    """One row that was not taken: its line (from 1), its bucket, the column and the fix."""

    line: int
    reason: MessageReject
    column: str
    message: str


class StaticsFilter:
    """Tells statics that a vessel's row before did not say; tables repeat them in every row."""

    def __init__(self) -> None:
        self._last: dict[int, tuple[object, ...]] = {}

    def is_new(self, static: ais.StaticReport) -> bool:
        """Return whether a vessel says something else than before; if so, remember it."""
        said = (
            static.name,
            static.callsign,
            static.imo,
            static.ship_type,
            static.to_bow_m,
            static.to_stern_m,
            static.to_port_m,
            static.to_starboard_m,
        )
        if self._last.get(static.mmsi) == said:
            return False
        if len(self._last) >= _MOST_VESSELS:
            self._last.clear()
        self._last[static.mmsi] = said
        return True


@dataclass(slots=True)
class CsvDecoder:
    """Decodes one table; `errors` keeps its first hundred bad rows, `accounting` counts all.

    `mapping` says how to read it; where none is given it is proposed from the first lines.
    `rejects` hears of every bad row.
    """

    not_after: datetime = DISTANT
    mapping: TableMapping | None = None
    rejects: RejectLog | None = None
    accounting: Accounting = field(default_factory=Accounting)
    errors: list[RowError] = field(default_factory=list)
    _repeats: RepeatFilter = field(default_factory=RepeatFilter)
    _statics: StaticsFilter = field(default_factory=StaticsFilter)
    _reader: CellReader | None = None
    _wants_header: bool = False
    _line_number: int = 0

    def decode(self, lines: Iterable[str]) -> Iterator[ais.PositionReport | ais.StaticReport]:
        """Yield each row's position, and its statics where they are new.

        Lines may come in several calls; those of the first tell how the table is made.

        Raises:
            CsvHeaderError: no mapping is given, and none can be proposed that has mmsi, time, lat
                and lon.

        """
        rest = iter(lines)
        head: list[str] = []
        if self._reader is None:
            head = list(islice(rest, _HEAD_LINES))
            self.mapping = self.mapping or proposed_mapping(head)
            self._reader = CellReader(self.mapping, self.not_after)
            self._wants_header = self.mapping.has_header
        mapping = self.mapping or TableMapping({})
        for line in chain(head, rest):
            self._line_number += 1
            if self.rejects is not None:
                self.rejects.at(line.rstrip("\r\n").encode())
            if self._wants_header and (not is_comment(line) or is_header(line)):
                self._wants_header = False
                self.accounting.lines.other += 1
            elif is_comment(line):
                self.accounting.lines.other += 1
            else:
                yield from self._line(line, self._line_number, mapping, self._reader)

    def _line(
        self, line: str, number: int, mapping: TableMapping, reader: CellReader
    ) -> Iterator[ais.PositionReport | ais.StaticReport]:
        """Read a line; each is split alone, so that a stray quote costs no other line."""
        try:
            row = _cells(line, mapping.delimiter)
        except csv.Error as error:
            self.accounting.lines.other += 1
            problem = f"this line is no row of a table: {error}"
            self._note(RowError(number, MessageReject.FIELD, "row", problem))
            return
        if not any(row):
            self.accounting.lines.other += 1
            return
        self._count_row()
        cells = {name: row[at] for name, at in mapping.columns.items() if at < len(row)}
        try:
            position = position_of(cells, reader)
            static = static_of(cells, reader, position.mmsi, position.received_at)
        except RowRejectedError as rejected:
            self.accounting.messages.rejected[rejected.reason] += 1
            self._note(RowError(number, rejected.reason, rejected.column, str(rejected)))
            if self.rejects is not None:
                self.rejects.row(rejected.reason, f"{rejected.column}: {rejected}")
            return
        if self._repeats.is_repeat("\x1f".join(row).encode(), position.received_at):
            self.accounting.messages.duplicates += 1
            return
        self.accounting.messages.positions += 1
        yield position
        if static is not None and self._statics.is_new(static):
            yield static

    def _count_row(self) -> None:
        """Count a row as one line, one sentence and one message."""
        self.accounting.lines.sentence += 1
        self.accounting.sentences.total += 1
        self.accounting.sentences.assembled += 1
        self.accounting.messages.assembled += 1

    def _note(self, error: RowError) -> None:
        if len(self.errors) < _MOST_ERRORS:
            self.errors.append(error)


def _cells(line: str, delimiter: str) -> list[str]:
    if len(line) > LONGEST_LINE:
        msg = f"longer than {LONGEST_LINE} characters"
        raise csv.Error(msg)
    return split_row(line.rstrip("\r\n").lstrip("\ufeff"), delimiter)


def proposed_mapping(head: list[str]) -> TableMapping:
    """Propose a mapping from a table's first lines. Raises CsvHeaderError without a whole one."""
    mapping = propose(head).mapping
    if mapping.missing:
        msg = (
            f"the table has no column {', '.join(mapping.missing)}: its first line must name at "
            f"least {', '.join(REQUIRED)}, or the columns must be {','.join(COLUMNS)}; or say "
            "which column is which"
        )
        raise CsvHeaderError(msg)
    return mapping


def position_of(cells: Cells, reader: CellReader, message_type: int = 0) -> ais.PositionReport:
    """Return a row's position. Raises RowRejectedError naming the column."""
    mmsi = reader.whole(cells, "mmsi")
    if mmsi is None or not ais.is_vessel_mmsi(mmsi):
        message = (
            f"{cells.get('mmsi', '')[:20] or 'empty'} is not a vessel's MMSI: 200000000 to "
            "799999999"
        )
        raise RowRejectedError(MessageReject.MMSI_KIND, "mmsi", message)
    moment = reader.moment(cells)
    lat_deg, lon_deg = reader.place(cells, "lat", 90.0), reader.place(cells, "lon", 180.0)
    return ais.PositionReport(
        mmsi,
        moment,
        moment,
        lat_deg,
        lon_deg,
        reader.speed_kn(cells),
        within(reader.number(cells, "cog"), 360.0),
        within(reader.number(cells, "heading"), 360.0),
        reader.number(cells, "rot"),
        message_type,
        _class(cells),
        None,
        ais.FixTimeSource.STATED,
    )


def static_of(
    cells: Cells, reader: CellReader, mmsi: int, received_at: datetime
) -> ais.StaticReport | None:
    """Return what a row says of the vessel itself; None if nothing."""
    size = ais.antenna_distances_m(
        *(reader.distance_m(cells, f"to_{side}") for side in ("bow", "stern", "port", "starboard"))
    )
    if size[0] is None:
        length_m, width_m = reader.distance_m(cells, "length"), reader.distance_m(cells, "width")
        size = ais.antenna_distances_m(0, length_m, 0, width_m)
    name = ais.clean_text(reader.text(cells, "name"))
    callsign = ais.clean_text(reader.text(cells, "callsign"))
    imo_text = reader.text(cells, "imo").upper().removeprefix("IMO").strip()
    imo = ais.positive_or_none(int(imo_text) if imo_text.isascii() and imo_text.isdigit() else 0)
    ship_type = _ship_type(cells, reader)
    if name is None and callsign is None and imo is None and ship_type is None and size[0] is None:
        return None
    return ais.StaticReport(mmsi, received_at, name, callsign, imo, ship_type, *size)


def _ship_type(cells: Cells, reader: CellReader) -> int | None:
    """Return the type as a message has it; of words only those that the Danish archive writes."""
    text = reader.text(cells, "ship_type")
    if text[:1].isalpha():
        return SHIP_TYPE_WORDS.get(text.lower())
    return ais.positive_or_none(reader.whole(cells, "ship_type") or 0)


def _class(cells: Cells) -> ais.AisClass | None:
    text = cells.get("ais_class", "").upper().removeprefix("CLASS").strip()
    return "A" if text == "A" else "B" if text == "B" else None
