"""A text's bytes as all decoders read them: UTF-8, with lines that end in a line feed.

Windows' tools write UTF-16 (a receiver's output redirected, a table saved as "Unicode text"), some
loggers end their lines with a carriage return only. Both are told by the beginning of a text;
whatever is usual passes through as it is.
"""

import codecs
from collections.abc import Iterator

_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def plain_text(chunks: Iterator[bytes]) -> Iterator[bytes]:
    """Yield the chunks of a text, none of them empty."""
    first = next(chunks, b"")
    if first.startswith(_UTF_16):
        chunks = _from_utf_16(first, chunks)
        first = next(chunks, b"")
    ends_in_returns = b"\r" in first and b"\n" not in first
    while first:
        yield first.replace(b"\r", b"\n") if ends_in_returns else first
        first = next(chunks, b"")


def _from_utf_16(first: bytes, chunks: Iterator[bytes]) -> Iterator[bytes]:
    decoder = codecs.getincrementaldecoder("utf-16")("replace")
    chunk = first
    while chunk:
        if text := decoder.decode(chunk):
            yield text.encode("utf-8", "replace")
        chunk = next(chunks, b"")
