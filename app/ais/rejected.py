"""The lines of a recording that were not taken, found again by decoding its stored bytes.

Keeping them beside the accounting would need room without bound. The bytes are kept, the decoders
are the same, and what may differ between two readings (the mapping of a table, the moment that
bounds plausible times) is kept with the file: so the same lines are found, as many as are counted.
"""

import csv
import io
from collections.abc import Iterable, Iterator
from typing import IO

from app.ais.preview import RejectSeen
from app.ais.recording import Recording
from app.domain.rejects import Reject
from app.domain.table_mapping import TableMapping
from app.storage import Storage
from app.tables.ais import AisFile

COLUMNS = ("entry", "line", "reason", "meaning", "text")
_LINES_AT_ONCE = 2_000
_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")


def rejected_lines(
    storage: Storage, file: AisFile, *, max_bytes: int
) -> Iterator[list[RejectSeen]]:
    """Yield the rejected lines of a file, some at a time. Raises NotFound if its bytes are gone."""
    return _read(storage.open(file.sha256), file, max_bytes)


def _read(stream: IO[bytes], file: AisFile, max_bytes: int) -> Iterator[list[RejectSeen]]:
    found: list[RejectSeen] = []

    def keep(entry: str, reject: Reject) -> None:
        found.append(RejectSeen(entry, reject))

    with stream:
        recording = Recording(
            stream,
            max_bytes=max_bytes,
            mapping=TableMapping.of(file.mapping) if file.mapping else None,
            on_reject=keep,
            read_at=file.created_at,
        )
        for part in recording.texts():
            for _ in part.read(_LINES_AT_ONCE):
                if found:
                    yield found.copy()
                    found.clear()


def as_csv(batches: Iterable[list[RejectSeen]]) -> Iterator[str]:
    """Write rejected lines as a table; no cell of it is a formula to a spreadsheet."""
    yield _csv([COLUMNS])
    for batch in batches:
        yield _csv(
            (
                seen.entry,
                seen.reject.line,
                seen.reject.reason,
                seen.reject.message,
                seen.reject.text,
            )
            for seen in batch
        )


def _csv(rows: Iterable[Iterable[object]]) -> str:
    target = io.StringIO()
    csv.writer(target, lineterminator="\r\n").writerows([map(_cell, row) for row in rows])
    return target.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    if isinstance(value, str) and value.startswith(_FORMULA_STARTS):
        return f"'{value}"
    return value
