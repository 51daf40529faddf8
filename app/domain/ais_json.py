r"""AIS from lines of JSON, as AIS-catcher, gpsd and other receivers write them.

    {"class":"AIS","rxuxtime":1714564806.2,"nmea":["!AIVDM,2,1,...","!AIVDM,2,2,..."],"mmsi":...}

Sentences are trusted, fields that somebody decoded from them are not: only where there are no
sentences the fields are read, like a table's row. A row counts as one line, one sentence and one
message. Text before the brace (a logger's own date, in whatever zone) yields to the time within.
A line that is no such row, or brings part of a message only, goes the way of all other lines.

Sources: AIS-catcher's JSON output (rxtime, rxuxtime, nmea), gpsd_json(5), and logs of both.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime

from app.domain import ais
from app.domain.accounting import Accounting, LineCounts, MessageReject, SentenceCounts
from app.domain.ais_csv import StaticsFilter, position_of, static_of
from app.domain.ais_payload import RejectedMessageError, decode_payload
from app.domain.nmea import NmeaDecoder
from app.domain.nmea_lines import LONGEST_LINE, LineReader, Sentence
from app.domain.nmea_times import DISTANT, TimeReader
from app.domain.rejects import RejectLog
from app.domain.repeats import RepeatFilter
from app.domain.table_cells import CellReader, RowRejectedError
from app.domain.table_mapping import TableMapping, TimeFormat
from app.domain.table_names import meanings

Reports = tuple[ais.PositionReport | ais.StaticReport, ...]
Row = Mapping[str, object]

_TIMES = ("rxuxtime", "rxtime", "timestamp", "time", "ts", "received_at", "datetime", "toa")
_SENTENCES = ("nmea", "sentence", "sentences", "raw", "message", "msg", "data", "payload")
_POSITION_TYPES = frozenset({1, 2, 3, 18, 19})
_STATIC_TYPES = frozenset({5, 24})
# gpsd writes the message's own integers unless it is told to scale them.
_UNSCALED = {"lat": 600_000.0, "lon": 600_000.0, "speed": 10.0, "course": 10.0}
_NO_COLUMNS = TableMapping({})


class JsonDecoder:
    """Decodes lines one after another; `accounting` is the sum of rows and other lines."""

    def __init__(self, not_after: datetime = DISTANT, rejects: RejectLog | None = None) -> None:
        self._rejects = rejects
        self._text = NmeaDecoder(not_after, rejects)
        self._rows = Accounting() if rejects is None else rejects.accounting()
        self._times = TimeReader(not_after)
        self._cells = CellReader(_NO_COLUMNS, not_after)
        self._compact = CellReader(TableMapping({}, time_format=TimeFormat.COMPACT), not_after)
        self._repeats = RepeatFilter()
        self._statics = StaticsFilter()

    @property
    def accounting(self) -> Accounting:
        """What became of every line so far."""
        total = Accounting()
        total.add(self._text.accounting)
        total.add(self._rows)
        return total

    def decode(self, lines: Iterable[bytes]) -> Iterator[ais.PositionReport | ais.StaticReport]:
        """Yield the reports of lines; `finish` when there are no more."""
        for line in lines:
            yield from self._line(line)

    def finish(self) -> None:
        """End the input: what is unfinished becomes orphaned."""
        self._text.finish()

    def _line(self, line: bytes) -> Reports:
        row = row_of(line)
        if row is None:
            return self._text.feed(line)
        time = self._time(row)
        texts = _sentences_of(row)
        if not texts:
            return self._fields(line, row, time)
        counts = SentenceCounts()
        reader = LineReader(LineCounts(), counts, self._times)
        good = [sentence for text in texts for sentence in reader.read(text, None)]
        if counts.total and (not good or _is_one_message(good, counts.total)):
            self._begin(line)
            if not good:
                self._rows.sentences.rejected[next(iter(counts.rejected))] += 1
                return ()
            return self._message(good, time)
        return self._text.feed(_as_line(texts, time))

    def _begin(self, line: bytes) -> None:
        """Count a row as one line and one sentence."""
        if self._rejects is not None:
            self._rejects.at(line)
        self._rows.lines.sentence += 1
        self._rows.sentences.total += 1

    def _message(self, parts: list[Sentence], time: datetime | None) -> Reports:
        """Decode the message that all of a row's sentences make together."""
        self._rows.sentences.assembled += 1
        ordered = sorted(parts, key=lambda part: part.fragment_number)
        payload = b"".join(part.payload for part in ordered)
        heard = [part.received_at for part in ordered if part.received_at is not None]
        messages = self._rows.messages
        messages.assembled += 1
        try:
            reports = decode_payload(payload, ordered[-1].fill_bits, min(heard, default=time))
        except RejectedMessageError as rejected:
            messages.rejected[rejected.reason] += 1
            return ()
        if reports is None:
            messages.ignored_type += 1
            return ()
        return self._new(payload, reports)

    def _fields(self, line: bytes, row: Row, time: datetime | None) -> Reports:
        """Read a row that holds decoded fields only; other rows than AIS are other lines."""
        if "mmsi" not in {key.lower() for key in row}:
            self._rows.lines.other += 1
            if self._rejects is not None:
                self._rejects.at(line)
            return ()
        self._begin(line)
        self._rows.sentences.assembled += 1
        messages = self._rows.messages
        messages.assembled += 1
        cells = _cells_of(row)
        if time is not None:
            cells["time"] = time.isoformat()
        kind = row.get("type", row.get("msgtype", 0))
        message_type = kind if isinstance(kind, int) else 0
        try:
            if message_type in _STATIC_TYPES or (not message_type and "lat" not in cells):
                reports = self._static(cells)
            elif not message_type or message_type in _POSITION_TYPES:
                position = position_of(cells, self._cells, message_type)
                static = static_of(cells, self._cells, position.mmsi, position.received_at)
                is_told = static is not None and self._statics.is_new(static)
                reports = (position, static) if static is not None and is_told else (position,)
            else:
                reports = ()
        except RowRejectedError as rejected:
            self._rows.messages.rejected[rejected.reason] += 1
            return ()
        if not reports:
            messages.ignored_type += 1
            return ()
        return self._new(json.dumps(cells).encode(), reports)

    def _static(self, cells: dict[str, str]) -> Reports:
        mmsi = self._cells.whole(cells, "mmsi")
        if mmsi is None or not ais.is_vessel_mmsi(mmsi):
            raise RowRejectedError(MessageReject.MMSI_KIND, "mmsi", "not a vessel's MMSI")
        static = static_of(cells, self._cells, mmsi, self._cells.moment(cells))
        return () if static is None else (static,)

    def _new(self, key: bytes, reports: Reports) -> Reports:
        """Count reports, unless they repeat others."""
        messages = self._rows.messages
        if self._repeats.is_repeat(key, reports[0].received_at):
            messages.duplicates += 1
            return ()
        if isinstance(reports[0], ais.PositionReport):
            messages.positions += 1
        else:
            messages.statics += 1
        return reports

    def _time(self, row: Row) -> datetime | None:
        """Return the first time of a row that can be read, in the order of what is exact."""
        for name in _TIMES:
            text = str(row.get(name, ""))
            if text:
                for reader in (self._compact, self._cells):
                    try:
                        return reader.moment({"time": text})
                    except RowRejectedError:
                        continue
        return None


def row_of(line: bytes) -> Row | None:
    """Return the object that a line holds, whatever stands before it; None without one."""
    start = line.find(b"{")
    if start < 0 or len(line) > LONGEST_LINE:
        return None
    try:
        row = json.loads(line[start:].rstrip().rstrip(b",]"))
    except (ValueError, RecursionError):
        return None
    return row if isinstance(row, dict) else None


def _sentences_of(row: Row) -> list[bytes]:
    for name in _SENTENCES:
        value = row.get(name)
        texts = value if isinstance(value, list) else [value]
        found = [
            text.encode("utf-8", "replace")
            for text in texts
            if isinstance(text, str) and "!" in text
        ]
        if found:
            return found
    return []


def _is_one_message(parts: list[Sentence], total: int) -> bool:
    """Whether sentences are all the parts of one message, and nothing else."""
    numbers = {part.fragment_number for part in parts}
    return (
        len(parts) == total == len(numbers)
        and all(part.fragment_count == total for part in parts)
        and len({(part.tag, part.channel, part.sequence) for part in parts}) == 1
    )


def _as_line(texts: list[bytes], time: datetime | None) -> bytes:
    """Write sentences and their time as a line of a plain log."""
    stamp = time.astimezone(UTC).isoformat().encode() + b" " if time is not None else b""
    return stamp + b" ".join(texts)


def _cells_of(row: Row) -> dict[str, str]:
    """Return a row's fields as a table's cells; numbers that gpsd left unscaled are scaled."""
    is_raw = row.get("scaled") is False
    keys = list(row)
    cells = {}
    for name, index in meanings(keys).items():
        value = row[keys[index]]
        if is_raw and isinstance(value, int) and (unit := _UNSCALED.get(keys[index])):
            value = value / unit
        if isinstance(value, str | int | float) and not isinstance(value, bool):
            cells[name] = str(value).strip()
    if not _is_number(cells.get("rot", "")) or is_raw:
        cells.pop("rot", None)  # gpsd tells some rates in words
    return cells


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
