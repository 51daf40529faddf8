"""A recording, read as a stream: what kind of file it is, and the reports in it.

Nobody is asked for a format: the content tells. Receivers write a file a day and people send the
month as one zip, so a recording is one text or an archive of several. Each text is decoded on its
own, because parts of messages and repeats are told apart within one input; the accounting is the
sum of all.
"""

from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from itertools import chain
from typing import IO

from app import archives
from app.ais.part import WANTED, Part, TextAllowance
from app.db import now
from app.domain.accounting import Accounting
from app.domain.nmea_bulk import Decoded
from app.domain.rejects import Reject, RejectLog
from app.domain.table_mapping import TableMapping
from app.errors import Invalid

CLOCK_ALLOWANCE = timedelta(days=7)  # a receiver's clock may be off; its times are kept as told


class Recording:
    """An open recording; `accounting` and `format` are complete once all its reports were read.

    Nothing of it may be stored before that, because damage may stand in its last bytes. Raises
    Invalid for what is no recording, TooLarge beyond `max_bytes` of text or for an archive made to
    harm. `mapping` says how to read its tables, `on_reject` hears of each line that was not taken,
    with the entry of the archive; `read_at` is when it is read, which bounds plausible times.
    """

    def __init__(
        self,
        stream: IO[bytes],
        *,
        max_bytes: int,
        mapping: TableMapping | None = None,
        on_reject: Callable[[str, Reject], None] | None = None,
        read_at: datetime | None = None,
    ) -> None:
        self.read_at = read_at or now()
        self._mapping = mapping
        self._on_reject = on_reject
        self._allowance = TextAllowance(max_bytes)
        self._formats: set[str] = set()
        self.is_zip = archives.is_zip(stream)
        self._texts: Iterator[tuple[str, IO[bytes]]] = iter([("", stream)])
        if self.is_zip:
            self._texts = archives.entries(stream, archives.Limits(unfolded_bytes=max_bytes))
        self.accounting = Accounting()

    @property
    def format(self) -> str:
        """What it is made of: `nmea`, `csv+gzip`, or all kinds in an archive: `zip(csv,nmea)`."""
        kinds = ",".join(sorted(self._formats))
        return f"zip({kinds})" if self.is_zip else kinds

    def texts(self) -> Iterator[Part]:
        """Yield each text, to be read to its end before the next is asked for."""
        for entry, text in self._texts:
            part = Part(
                text,
                self._allowance,
                self.read_at + CLOCK_ALLOWANCE,
                entry,
                mapping=self._mapping,
                rejects=self._log(entry),
            )
            self._formats.add(part.format)
            yield part
            self.accounting.add(part.accounting)
        if not self._formats:
            raise Invalid.field("file", f"this is a zip archive without a file in it; {WANTED}")

    def parts(self) -> Iterator[Iterator[Decoded]]:
        """Yield the reports of each text, to be read to their end before the next is asked for."""
        return (part.reports() for part in self.texts())

    def reports(self) -> Iterator[Decoded]:
        """Yield all reports, once."""
        return chain.from_iterable(self.parts())

    def _log(self, entry: str) -> RejectLog | None:
        tell = self._on_reject
        return RejectLog(lambda reject: tell(entry, reject)) if tell is not None else None
