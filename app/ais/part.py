"""One text of a recording: NMEA or a table, plain or gzip, as its content tells.

Memory stays flat whatever the length, because both decoders take a line at a time. The limit on
size counts what comes out of gzip, so that a small file cannot unfold into a full disk.
"""

import gzip
import re
import zlib
from collections.abc import Iterable, Iterator
from datetime import datetime
from enum import StrEnum
from typing import IO

from app.domain.accounting import Accounting
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_csv import COLUMNS, CsvDecoder, CsvHeaderError
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.nmea_lines import split_lines
from app.errors import Invalid, TooLarge

Report = PositionReport | StaticReport

_CHUNK_BYTES = 1 << 18
_LONGEST_SHOWN = 120
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
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
)
WANTED = (
    "wanted are lines with !AIVDM or !AIVDO sentences, or a table with the columns "
    f"{','.join(COLUMNS[:6])}[,{','.join(COLUMNS[6:])}], plain, gzip or zip"
)


class PartFormat(StrEnum):
    """What a text is made of."""

    NMEA = "nmea"
    NMEA_GZIP = "nmea+gzip"
    CSV = "csv"
    CSV_GZIP = "csv+gzip"


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

    `entry` is its name where it comes from an archive: errors tell it. Raises Invalid for what is
    no recording.
    """

    def __init__(
        self, stream: IO[bytes], allowance: TextAllowance, not_after: datetime, entry: str = ""
    ) -> None:
        self._where = f"its entry {entry[:_LONGEST_SHOWN]!r}: " if entry else ""
        stream.seek(0)
        is_gzip = stream.read(2) == _GZIP
        stream.seek(0)
        self._chunks = allowance.charged(self._unpacked(stream) if is_gzip else _plain(stream))
        self._first_chunk = next(self._chunks, b"")
        self._csv: CsvDecoder | None = None
        self._nmea = NmeaDecoder(not_after)
        if self._is_nmea(self._first_chunk):
            self.format = PartFormat.NMEA_GZIP if is_gzip else PartFormat.NMEA
        else:
            self.format = PartFormat.CSV_GZIP if is_gzip else PartFormat.CSV
            self._csv = CsvDecoder(not_after)

    @property
    def accounting(self) -> Accounting:
        """What became of every line so far."""
        return self._nmea.accounting if self._csv is None else self._csv.accounting

    def reports(self) -> Iterator[Report]:
        """Yield all reports once. Raises Invalid when the text turns out to hold none at all."""
        lines = split_lines(self._all_chunks())
        if self._csv is None:
            yield from decode_lines(lines, self._nmea)
        else:
            try:
                yield from self._csv.decode(
                    f"{line.decode('utf-8', 'replace')}\n" for line in lines
                )
            except CsvHeaderError as error:
                raise self._refused(str(error)) from error
        if self.accounting.sentences.total == 0:
            found = f"{self.accounting.lines.total} lines without one AIS sentence or row"
            raise self._refused(f"{found}; {WANTED}")

    def _all_chunks(self) -> Iterator[bytes]:
        yield self._first_chunk
        yield from self._chunks

    def _unpacked(self, stream: IO[bytes]) -> Iterator[bytes]:
        with gzip.GzipFile(fileobj=stream, mode="rb") as unpacked:
            try:
                yield from _plain(unpacked)
            except (OSError, EOFError, zlib.error) as error:
                raise self._refused(f"its gzip data is damaged or cut off: {error}") from error

    def _is_nmea(self, head: bytes) -> bool:
        """Whether the beginning of a text is NMEA, not a table. Raises Invalid for neither."""
        if not head:
            raise self._refused(f"it is empty; {WANTED}")
        if b"\x00" in head or any(head.startswith(magic) for magic, _ in _BINARY_KINDS):
            kind = next(
                (kind for magic, kind in _BINARY_KINDS if head.startswith(magic)), "binary data"
            )
            raise self._refused(f"this is {kind}; {WANTED}")
        if _SENTENCE.search(head) or head.lstrip()[:1] in {b"$", b"!", b"\\"}:
            return True
        lines = (line for line in head.splitlines() if line.strip()[:1] not in {b"", b"#"})
        first = next(lines, b"")
        if b"," not in first or first.lstrip()[:1] in {b"<", b"{", b"["}:
            start = first[:40].decode("utf-8", "replace")
            raise self._refused(f"it begins with {start!r}; {WANTED}")
        return False

    def _refused(self, reason: str) -> Invalid:
        return Invalid.field("file", f"{self._where}{reason}")


def _plain(stream: IO[bytes] | gzip.GzipFile) -> Iterator[bytes]:
    while chunk := stream.read(_CHUNK_BYTES):
        yield chunk
