"""What the lines of a text are, told by its beginning: NMEA, JSON, a table, or no AIS at all."""

import re
from collections.abc import Iterable
from enum import StrEnum
from itertools import islice

from app.domain.ais_json import row_of
from app.domain.nmea_lines import split_lines
from app.domain.table_mapping import COLUMNS
from app.errors import FieldError, Invalid

GZIP = b"\x1f\x8b"
_LONGEST_SHOWN = 120
_LINES_LOOKED_AT = 50
_MOST_NULS = 0.05  # of a text; a serial line's noise brings some
_SENTENCE = re.compile(rb"![0-9A-Z-]{2}VD[MO],")
_BINARY_KINDS = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"PK\x03\x04", "a zip archive"),
    (b"%PDF", "a PDF document"),
    (b"SQLite format 3", "an SQLite database"),
    (GZIP, "gzip within gzip"),
    (b"BZh", "bzip2 data"),
    (b"\xfd7zXZ", "xz data"),
    (b"\x28\xb5\x2f\xfd", "Zstandard data, which has to be unpacked first"),
    (b"PAR1", "a Parquet file"),
)
WANTED = (
    "wanted are lines with !AIVDM or !AIVDO sentences, lines of JSON, or a table with the columns "
    f"{','.join(COLUMNS[:6])}[,{','.join(COLUMNS[6:])}], plain, gzip or zip"
)


class NotARecordingError(Invalid):
    """What was sent is whole, but no AIS; `reason` says what it is, without naming the entry."""

    def __init__(self, reason: str, entry: str = "") -> None:
        message = f"{naming(entry)}{reason}; {WANTED}"
        super().__init__(f"file: {message}", fields=(FieldError("file", message),))
        self.reason = reason


class TextKind(StrEnum):
    """What the lines of a text are."""

    NMEA = "nmea"
    JSON = "json"
    CSV = "csv"


def naming(entry: str) -> str:
    """Return how an error begins that is about an archive's entry; empty for a text alone."""
    return f"its entry {entry[:_LONGEST_SHOWN]!r}: " if entry else ""


def recognised(head: bytes, entry: str = "") -> TextKind:
    """Tell the kind by the beginning of a text. Raises NotARecordingError for none."""
    if not head:
        raise NotARecordingError("it is empty", entry)
    if kind := _binary_kind(head):
        raise NotARecordingError(f"this is {kind}", entry)
    lines = list(islice(filter(bytes.strip, split_lines([head])), _LINES_LOOKED_AT))
    if any(b"{" in line and row_of(line) is not None for line in lines):
        return TextKind.JSON
    if _SENTENCE.search(head) or head.lstrip()[:1] in {b"$", b"!", b"\\"}:
        return TextKind.NMEA
    first = _first_row(lines) or head[:40]
    is_row = any(mark in first for mark in (b",", b";", b"\t", b"|"))
    if not is_row or first.lstrip()[:1] in {b"<", b"{", b"["}:
        start = first[:40].decode("utf-8", "replace")
        raise NotARecordingError(f"it begins with {start!r}", entry)
    return TextKind.CSV


def _first_row(lines: Iterable[bytes]) -> bytes:
    return next((line for line in lines if line.lstrip()[:1] != b"#"), b"")


def _binary_kind(head: bytes) -> str:
    """Say what a beginning is that is no text; empty for a text, also one from a noisy line."""
    if head[257:262] == b"ustar":
        return "a tar archive"
    kind = next((kind for magic, kind in _BINARY_KINDS if head.startswith(magic)), "")
    text = head.rstrip(b"\0")  # what a logger set aside and did not fill
    return kind or ("binary data" if text.count(0) >= max(1, _MOST_NULS * len(text)) else "")
