"""A recording, read as a stream: what kind of file it is, and the reports in it.

Nobody is asked for a format: the content tells. Gzip is undone on the way, and the limit on size
counts what comes out of it, so that a small file cannot unfold into a full disk. Memory stays flat
whatever the length, because both decoders take a line at a time.
"""

import gzip
import re
import zlib
from collections.abc import Iterator
from datetime import datetime, timedelta
from enum import StrEnum
from typing import IO

from app.db import now
from app.domain.accounting import Accounting
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_csv import COLUMNS, CsvDecoder, CsvHeaderError, RowError
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.nmea_lines import split_lines
from app.errors import Invalid, TooLarge

Report = PositionReport | StaticReport

_CHUNK_BYTES = 1 << 18
_GZIP = b"\x1f\x8b"
_SENTENCE = re.compile(rb"![0-9A-Z-]{2}VD[MO],")
_CLOCK_ALLOWANCE = timedelta(days=7)  # a receiver's clock may be off; its times are kept as told
_BINARY_KINDS = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"PK\x03\x04", "a zip archive"),
    (b"%PDF", "a PDF document"),
    (b"SQLite format 3", "an SQLite database"),
    (_GZIP, "gzip within gzip"),
    (b"BZh", "bzip2 data"),
    (b"\xfd7zXZ", "xz data"),
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
)
_WANTED = (
    "wanted are lines with !AIVDM or !AIVDO sentences, or a table with the columns "
    f"{','.join(COLUMNS[:6])}[,{','.join(COLUMNS[6:])}], plain or gzip"
)


class RecordingFormat(StrEnum):
    """What a recording is made of, as stored with the file."""

    NMEA = "nmea"
    NMEA_GZIP = "nmea+gzip"
    CSV = "csv"
    CSV_GZIP = "csv+gzip"


class Recording:
    """An open recording; `accounting` and `row_errors` are complete once `reports` has ended.

    Raises Invalid for what is no recording, TooLarge beyond `max_bytes` of text.
    """

    def __init__(
        self, stream: IO[bytes], *, max_bytes: int, not_after: datetime | None = None
    ) -> None:
        not_after = not_after or now() + _CLOCK_ALLOWANCE
        stream.seek(0)
        is_gzip = stream.read(2) == _GZIP
        stream.seek(0)
        self._chunks = _bounded(_unpacked(stream) if is_gzip else _plain(stream), max_bytes)
        self._first_chunk = next(self._chunks, b"")
        self._csv: CsvDecoder | None = None
        self._nmea = NmeaDecoder(not_after)
        if _is_nmea(self._first_chunk):
            self.format = RecordingFormat.NMEA_GZIP if is_gzip else RecordingFormat.NMEA
        else:
            self.format = RecordingFormat.CSV_GZIP if is_gzip else RecordingFormat.CSV
            self._csv = CsvDecoder(not_after)

    @property
    def accounting(self) -> Accounting:
        """What became of every line so far."""
        return self._nmea.accounting if self._csv is None else self._csv.accounting

    @property
    def row_errors(self) -> list[RowError]:
        """The first bad rows of a table, each with its line, column and fix."""
        return [] if self._csv is None else self._csv.errors

    def reports(self) -> Iterator[Report]:
        """Yield all reports once. Raises Invalid when the file turns out to hold none at all."""
        lines = split_lines(self._all_chunks())
        if self._csv is None:
            yield from decode_lines(lines, self._nmea)
        else:
            try:
                yield from self._csv.decode(
                    f"{line.decode('utf-8', 'replace')}\n" for line in lines
                )
            except CsvHeaderError as error:
                raise Invalid.field("file", str(error)) from error
        if self.accounting.sentences.total == 0:
            found = f"{self.accounting.lines.total} lines without one AIS sentence or row"
            raise Invalid.field("file", f"{found}; {_WANTED}")

    def _all_chunks(self) -> Iterator[bytes]:
        yield self._first_chunk
        yield from self._chunks


def _plain(stream: IO[bytes]) -> Iterator[bytes]:
    while chunk := stream.read(_CHUNK_BYTES):
        yield chunk


def _unpacked(stream: IO[bytes]) -> Iterator[bytes]:
    with gzip.GzipFile(fileobj=stream, mode="rb") as unpacked:
        try:
            while chunk := unpacked.read(_CHUNK_BYTES):
                yield chunk
        except (OSError, EOFError, zlib.error) as error:
            raise Invalid.field("file", f"its gzip data is damaged or cut off: {error}") from error


def _bounded(chunks: Iterator[bytes], max_bytes: int) -> Iterator[bytes]:
    total = 0
    for chunk in chunks:
        total += len(chunk)
        if total > max_bytes:
            raise TooLarge(
                f"the recording holds more than {max_bytes} bytes of text; split it, or raise "
                "QUAYMARK_MAX_AIS_FILE_BYTES"
            )
        yield chunk


def _is_nmea(head: bytes) -> bool:
    """Whether the beginning of a file is NMEA, not a table. Raises Invalid for neither."""
    if not head:
        raise Invalid.field("file", f"it is empty; {_WANTED}")
    if b"\x00" in head or any(head.startswith(magic) for magic, _ in _BINARY_KINDS):
        kind = next(
            (kind for magic, kind in _BINARY_KINDS if head.startswith(magic)), "binary data"
        )
        raise Invalid.field("file", f"this is {kind}; {_WANTED}")
    if _SENTENCE.search(head) or head.lstrip()[:1] in {b"$", b"!", b"\\"}:
        return True
    first = next((line for line in head.splitlines() if line.strip()[:1] not in {b"", b"#"}), b"")
    if b"," not in first or first.lstrip()[:1] in {b"<", b"{", b"["}:
        start = first[:40].decode("utf-8", "replace")
        raise Invalid.field("file", f"it begins with {start!r}; {_WANTED}")
    return False
