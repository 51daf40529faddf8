"""One text of a recording: NMEA, lines of JSON or a table, plain or gzip, as its content tells.

Memory stays flat whatever the length, because all decoders take a line at a time. The limit on
size counts what comes out of gzip, so that a small file cannot unfold into a full disk.
"""

import gzip
import re
import zlib
from collections.abc import Iterable, Iterator
from datetime import datetime
from enum import StrEnum
from itertools import islice
from typing import IO

from app.ais.plain_text import plain_text
from app.domain.accounting import Accounting
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_csv import CsvDecoder, CsvHeaderError
from app.domain.ais_json import JsonDecoder, row_of
from app.domain.nmea import NmeaDecoder
from app.domain.nmea_bulk import Decoded, decode_recording
from app.domain.nmea_lines import split_lines
from app.domain.rejects import RejectLog
from app.domain.table_mapping import COLUMNS, TableMapping
from app.domain.table_proposal import Proposal, propose
from app.errors import Invalid, TooLarge

Report = PositionReport | StaticReport

_CHUNK_BYTES = 1 << 18
_LONGEST_SHOWN = 120
_LINES_LOOKED_AT = 50
_MOST_NULS = 0.05  # of a text; a serial line's noise brings some
_GZIP = b"\x1f\x8b"
_SENTENCE = re.compile(rb"![0-9A-Z-]{2}VD[MO],")
_BINARY_KINDS = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"PK\x03\x04", "a zip archive"),
    (b"%PDF", "a PDF document"),
    (b"SQLite format 3", "an SQLite database"),
    (_GZIP, "gzip within gzip"),
    (b"BZh", "bzip2 data"),
    (b"\xfd7zXZ", "xz data"),
    (b"\x28\xb5\x2f\xfd", "Zstandard data, which has to be unpacked first"),
    (b"PAR1", "a Parquet file"),
)
WANTED = (
    "wanted are lines with !AIVDM or !AIVDO sentences, lines of JSON, or a table with the columns "
    f"{','.join(COLUMNS[:6])}[,{','.join(COLUMNS[6:])}], plain, gzip or zip"
)


class TextKind(StrEnum):
    """What the lines of a text are."""

    NMEA = "nmea"
    JSON = "json"
    CSV = "csv"


class TextAllowance:
    """How many bytes of text all parts of a recording may have together."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._taken_bytes = 0

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
    a table; without one its header tells. Raises Invalid for what is no recording.
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
    ) -> None:
        self.entry = entry
        self.is_read_out = False
        stream.seek(0)
        self.is_gzip = stream.read(2) == _GZIP
        stream.seek(0)
        chunks = self._unpacked(stream) if self.is_gzip else _plain(stream)
        self._chunks = plain_text(allowance.charged(chunks))
        self._first_chunk = next(self._chunks, b"")
        self.kind = self._recognised(self._first_chunk)
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
        """Yield all reports once. Raises Invalid when the text turns out to hold none at all."""
        if isinstance(self._decoder, NmeaDecoder):
            yield from decode_recording(self._all_chunks(), self._decoder)
        else:
            yield from self._decoded(split_lines(self._all_chunks()))
            self._finish()
        if self.accounting.sentences.total == 0:
            found = f"{self.accounting.lines.total} lines without one AIS sentence or row"
            raise self._refused(f"{found}; {WANTED}")

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
        yield

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
                raise self._refused(str(error)) from error

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
                raise self._refused(f"its gzip data is damaged or cut off: {error}") from error

    def _recognised(self, head: bytes) -> TextKind:
        """Tell the kind by the beginning of a text. Raises Invalid for none."""
        if not head:
            raise self._refused(f"it is empty; {WANTED}")
        if kind := _binary_kind(head):
            raise self._refused(f"this is {kind}; {WANTED}")
        lines = list(islice(filter(bytes.strip, self._head_lines()), _LINES_LOOKED_AT))
        if any(b"{" in line and row_of(line) is not None for line in lines):
            return TextKind.JSON
        if _SENTENCE.search(head) or head.lstrip()[:1] in {b"$", b"!", b"\\"}:
            return TextKind.NMEA
        first = next((line for line in lines if line.lstrip()[:1] != b"#"), b"") or head[:40]
        is_row = any(mark in first for mark in (b",", b";", b"\t", b"|"))
        if not is_row or first.lstrip()[:1] in {b"<", b"{", b"["}:
            start = first[:40].decode("utf-8", "replace")
            raise self._refused(f"it begins with {start!r}; {WANTED}")
        return TextKind.CSV

    def _refused(self, reason: str) -> Invalid:
        where = f"its entry {self.entry[:_LONGEST_SHOWN]!r}: " if self.entry else ""
        return Invalid.field("file", f"{where}{reason}")


def _binary_kind(head: bytes) -> str:
    """Say what a beginning is that is no text; empty for a text, also one from a noisy line."""
    if head[257:262] == b"ustar":
        return "a tar archive"
    kind = next((kind for magic, kind in _BINARY_KINDS if head.startswith(magic)), "")
    text = head.rstrip(b"\0")  # what a logger set aside and did not fill
    return kind or ("binary data" if text.count(0) >= max(1, _MOST_NULS * len(text)) else "")


def _text(line: bytes) -> str:
    return f"{line.decode('utf-8', 'replace')}\n"


def _plain(stream: IO[bytes] | gzip.GzipFile) -> Iterator[bytes]:
    while chunk := stream.read(_CHUNK_BYTES):
        yield chunk
