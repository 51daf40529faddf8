"""A recording, read as a stream: what kind of file it is, and the reports in it.

Nobody is asked for a format: the content tells. Receivers write a file a day and people send the
month as one zip, so a recording is one text or an archive of several. Each text is decoded on its
own, because parts of messages and repeats are told apart within one input; the accounting is the
sum of all. What else people pack beside their recordings (a readme, a picture of the antenna) is
left out and told; of what is damaged or made to harm nothing is taken at all.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import chain
from typing import IO, Any

from app import archives
from app.ais.part import Part, TextAllowance
from app.ais.text_kind import NotARecordingError
from app.db import now
from app.domain.accounting import Accounting
from app.domain.nmea_bulk import Decoded
from app.domain.rejects import Reject, RejectLog
from app.domain.table_mapping import TableMapping

CLOCK_ALLOWANCE = timedelta(days=7)  # a receiver's clock may be off; its times are kept as told
_LONGEST_FORMAT = 32
_ENTRIES_TOLD = 3
_ENTRIES_KEPT = 50
_NO_COLUMNS = (
    "it is no table with columns known as mmsi, time, lat and lon; if it is AIS, send it alone and "
    "say which column is which"
)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """An entry of an archive that is no recording, and why."""

    entry: str
    reason: str


def told_of(left_out: Sequence[LeftOut]) -> dict[str, Any]:
    """Return what to keep of the entries left out: their count, and the first of them, as JSON."""
    first = [{"entry": left.entry, "reason": left.reason} for left in left_out[:_ENTRIES_KEPT]]
    return {"count": len(left_out), "first": first}


class Recording:
    """An open recording; what it tells of itself is complete once all its reports were read.

    Nothing of it may be stored before that, because damage may stand in its last bytes. Raises
    Invalid for what is no recording, TooLarge beyond `max_bytes` of text or for an archive made to
    harm. `mapping` says how to read its tables, `on_reject` hears of each line that was not taken,
    with the entry of the archive; `read_at` is when it is read, which bounds plausible times.
    `date_lines` bounds the search for a date that tells whether the day or the month comes first.
    `unknown_table` is the first table of an archive whose columns nobody knows.
    """

    def __init__(
        self,
        stream: IO[bytes],
        *,
        max_bytes: int,
        mapping: TableMapping | None = None,
        on_reject: Callable[[str, Reject], None] | None = None,
        read_at: datetime | None = None,
        date_lines: int | None = None,
    ) -> None:
        self.read_at = read_at or now()
        self._mapping = mapping
        self._on_reject = on_reject
        self._date_lines = date_lines
        self._allowance = TextAllowance(max_bytes)
        self._formats: set[str] = set()
        self.is_zip = archives.is_zip(stream)
        self._texts: Iterator[tuple[str, IO[bytes]]] = iter([("", stream)])
        if self.is_zip:
            self._texts = archives.entries(stream, archives.Limits(unfolded_bytes=max_bytes))
        self.accounting = Accounting()
        self.left_out: list[LeftOut] = []
        self.unknown_table: Part | None = None

    @property
    def format(self) -> str:
        """What it is made of: `nmea`, `csv+gzip`, or all kinds in an archive: `zip(csv,nmea)`."""
        kinds = self._formats
        told = ",".join(sorted(kinds))
        if not self.is_zip:
            return told
        if len(told) + len("zip()") > _LONGEST_FORMAT:
            told = ",".join(sorted({kind.removesuffix("+gzip") for kind in kinds}))
        return f"zip({told})"

    def texts(self) -> Iterator[Part]:
        """Yield each text, to be read to its end before the next is asked for."""
        for entry, text in self._texts:
            try:
                part = self._part(entry, text)
                yield part
                part.expect_content()
            except NotARecordingError as error:
                if not self.is_zip:
                    raise
                self.left_out.append(LeftOut(entry, error.reason))
            else:
                self._formats.add(part.format)
                self.accounting.add(part.accounting)
        if not self._formats:
            raise NotARecordingError(self._found_nothing())

    def _part(self, entry: str, text: IO[bytes]) -> Part:
        part = Part(
            text,
            self._allowance,
            self.read_at + CLOCK_ALLOWANCE,
            entry,
            mapping=self._mapping,
            rejects=self._log(entry),
            date_lines=self._date_lines,
        )
        if self.is_zip and part.lacks_columns:
            self.unknown_table = self.unknown_table or part
            raise NotARecordingError(_NO_COLUMNS, entry)
        return part

    def _found_nothing(self) -> str:
        if not self.left_out:
            return "this is a zip archive without a file in it"
        told = "; ".join(f"{left.entry!r}: {left.reason}" for left in self.left_out[:_ENTRIES_TOLD])
        more = len(self.left_out) - _ENTRIES_TOLD
        return f"no entry of it is a recording: {told}" + (f"; {more} more" if more > 0 else "")

    def parts(self) -> Iterator[Iterator[Decoded]]:
        """Yield the reports of each text, to be read to their end before the next is asked for."""
        return (part.reports() for part in self.texts())

    def reports(self) -> Iterator[Decoded]:
        """Yield all reports, once."""
        return chain.from_iterable(self.parts())

    def _log(self, entry: str) -> RejectLog | None:
        tell = self._on_reject
        return RejectLog(lambda reject: tell(entry, reject)) if tell is not None else None
