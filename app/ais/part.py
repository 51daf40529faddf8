"""One text of a recording: NMEA, lines of JSON or a table, plain or gzip, as its content tells.

Memory stays flat whatever the length, because all decoders take a line at a time. The limit on
size counts what comes out of gzip, so that a small file cannot unfold into a full disk.
"""

import gzip
import json
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from datetime import datetime
from itertools import islice
from typing import IO

from app.ais.plain_text import plain_text
from app.ais.text_kind import GZIP, NotARecordingError, TextKind, naming, recognised
from app.domain.accounting import Accounting
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_csv import CsvDecoder, CsvHeaderError
from app.domain.ais_json import JsonDecoder
from app.domain.date_order import first_told
from app.domain.nmea import NmeaDecoder
from app.domain.nmea_bulk import Decoded, decode_recording
from app.domain.nmea_lines import split_lines
from app.domain.rejects import RejectLog
from app.domain.table_mapping import TableMapping
from app.domain.table_proposal import (
    Proposal,
    is_comment,
    propose,
    split_row_or_nothing,
    times_of,
)
from app.errors import Invalid, TooLarge

Report = PositionReport | StaticReport

_CHUNK_BYTES = 1 << 18
_LINES_LOOKED_AT = 50


class TextAllowance:
    """How many bytes of text all parts of a recording may have together."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._taken_bytes = 0

    def apart(self) -> "TextAllowance":
        """Return the same for reading a part once more than it is counted."""
        other = TextAllowance(self._max_bytes)
        other._taken_bytes = self._taken_bytes
        return other

    def charged(self, chunks: Iterable[bytes]) -> Iterator[bytes]:
        """Hand chunks on and count them. Raises TooLarge when the allowance is used up."""
        for chunk in chunks:
            self._taken_bytes += len(chunk)
            if self._taken_bytes > self._max_bytes:
                raise TooLarge(
                    f"the recording holds more than {self._max_bytes} bytes of text; split it, or "
                    "raise QUAYMARK_MAX_AIS_FILE_BYTES"
                )
            yield chunk


class Part:
    """An open text; its accounting is complete once `reports` has ended.

    `entry` is its name where it comes from an archive: errors tell it. `mapping` says how to read
    a table; without one its header tells, and of `date_lines` lines (None: all) the first whose
    date has the day or the month first beyond doubt: then its `mapping` says so. `unsure_date` is a
    date that nothing tells of, else empty. Raises NotARecordingError for what is none.
    """

    def __init__(
        self,
        stream: IO[bytes],
        allowance: TextAllowance,
        not_after: datetime,
        entry: str = "",
        *,
        mapping: TableMapping | None = None,
        rejects: RejectLog | None = None,
        date_lines: int | None = None,
    ) -> None:
        self.entry = entry
        self.is_read_out = False
        self.unsure_date = ""
        stream.seek(0)
        self.is_gzip = stream.read(2) == GZIP
        self._open(stream, allowance.apart())
        self.kind = recognised(self._first_chunk, entry)
        self.lacks_columns = False
        if mapping is None and (proposal := self.proposal()):
            self.lacks_columns = bool(proposal.mapping.missing)
            if proposal.unsure_date and not self.lacks_columns:
                mapping = self._with_order(proposal, date_lines)
        self.mapping = mapping
        self._open(stream, allowance)
        self._decoder: NmeaDecoder | JsonDecoder | CsvDecoder
        match self.kind:
            case TextKind.NMEA:
                self._decoder = NmeaDecoder(not_after, rejects)
            case TextKind.JSON:
                self._decoder = JsonDecoder(not_after, rejects)
            case TextKind.CSV:
                self._decoder = CsvDecoder(not_after, mapping, rejects)

    @property
    def format(self) -> str:
        """What it is made of: `nmea`, `json`, `csv`, or one of them with `+gzip`."""
        return f"{self.kind}+gzip" if self.is_gzip else self.kind.value

    @property
    def accounting(self) -> Accounting:
        """What became of every line so far."""
        return self._decoder.accounting

    def proposal(self, delimiter: str | None = None) -> Proposal | None:
        """Return how a table seems to be made, None for what is no table."""
        if self.kind is not TextKind.CSV:
            return None
        head = map(_text, islice(self._head_lines(), 4 * _LINES_LOOKED_AT))
        return propose(list(head), delimiter)

    def reports(self) -> Iterator[Decoded]:
        """Yield all reports once. Raises Invalid for dates that may be meant in two ways."""
        if self.unsure_date:
            raise self._unsure()
        if isinstance(self._decoder, NmeaDecoder):
            yield from decode_recording(self._all_chunks(), self._decoder)
        else:
            yield from self._decoded(split_lines(self._all_chunks()))
            self._finish()
        self.is_read_out = True

    def first_reports(self, most_lines: int) -> Iterator[Report]:
        """Yield the reports of the first lines; parts of messages may then be pending."""
        lines = split_lines(self._all_chunks())
        yield from self._decoded(islice(lines, most_lines))
        self.is_read_out = next(lines, None) is None
        if self.is_read_out:
            self._finish()

    def read(self, lines_at_once: int) -> Iterator[None]:
        """Decode the whole text for what its reject log hears, pausing after so many lines."""
        lines = split_lines(self._all_chunks())
        while block := list(islice(lines, lines_at_once)):
            for _ in self._decoded(block):
                pass
            yield
        self._finish()
        self.is_read_out = True
        yield

    def expect_content(self) -> None:
        """Raise NotARecordingError if the text was read and holds no sentence and no row at all."""
        if self.is_read_out and self.accounting.sentences.total == 0:
            found = f"{self.accounting.lines.total} lines without one AIS sentence or row"
            raise NotARecordingError(found, self.entry)

    def _open(self, stream: IO[bytes], allowance: TextAllowance) -> None:
        stream.seek(0)
        chunks = self._unpacked(stream) if self.is_gzip else _plain(stream)
        self._chunks = plain_text(allowance.charged(chunks))
        self._first_chunk = next(self._chunks, b"")

    def _with_order(self, proposal: Proposal, most_lines: int | None) -> TableMapping:
        """Return a proposed mapping with the order of dates that the whole text tells, if any."""
        mapping = proposal.mapping
        lines = map(_text, islice(split_lines(self._all_chunks()), most_lines))
        rows = (
            split_row_or_nothing(line, mapping.delimiter) for line in lines if not is_comment(line)
        )
        order = first_told(times_of(mapping.columns, rows))
        if order is None:
            self.unsure_date = proposal.unsure_date
            return mapping
        return replace(mapping, time_format=order)

    def _unsure(self) -> Invalid:
        """Say that nobody can tell a table's dates, with the mapping that would."""
        proposal = self.proposal()
        mapping = proposal.mapping.as_dict() if proposal else {}
        told = json.dumps(mapping | {"time_format": "month_first"})
        return Invalid.field(
            "mapping",
            f"{naming(self.entry)}time: {self.unsure_date!r} may have the day or the month first, "
            f'and no row tells which; give the mapping {told}, or the same with "day_first"',
        )

    def _decoded(self, lines: Iterable[bytes]) -> Iterator[Report]:
        decoder = self._decoder
        if isinstance(decoder, NmeaDecoder):
            for line in lines:
                yield from decoder.feed(line)
        elif isinstance(decoder, JsonDecoder):
            yield from decoder.decode(lines)
        else:
            try:
                yield from decoder.decode(map(_text, lines))
            except CsvHeaderError as error:
                raise NotARecordingError(str(error), self.entry) from error

    def _finish(self) -> None:
        if not isinstance(self._decoder, CsvDecoder):
            self._decoder.finish()

    def _head_lines(self) -> Iterator[bytes]:
        return split_lines([self._first_chunk])

    def _all_chunks(self) -> Iterator[bytes]:
        yield self._first_chunk
        yield from self._chunks

    def _unpacked(self, stream: IO[bytes]) -> Iterator[bytes]:
        with gzip.GzipFile(fileobj=stream, mode="rb") as unpacked:
            try:
                yield from _plain(unpacked)
            except (OSError, EOFError, zlib.error) as error:
                reason = f"{naming(self.entry)}its gzip data is damaged or cut off: {error}"
                raise Invalid.field("file", reason) from error


def _text(line: bytes) -> str:
    return f"{line.decode('utf-8', 'replace')}\n"


def _plain(stream: IO[bytes] | gzip.GzipFile) -> Iterator[bytes]:
    while chunk := stream.read(_CHUNK_BYTES):
        yield chunk
