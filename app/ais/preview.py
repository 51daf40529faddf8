"""A recording looked at before it is imported: its format, its first reports, what is refused.

Only a bounded portion is read, so that a file of gigabytes is shown as soon as it is here. The
same decoders do it that import it, so what is shown is what will be.
"""

from collections import Counter
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import IO

from app.ais.part import Part, Report
from app.ais.recording import LeftOut, Recording
from app.ais.summary import RecordingSummary
from app.ais.text_kind import NotARecordingError
from app.domain.accounting import Accounting
from app.domain.rejects import Reject
from app.domain.table_mapping import TableMapping
from app.domain.table_proposal import Proposal

PREVIEW_LINES = 20_000
REPORTS_SHOWN = 10
REJECTS_OF_A_REASON = 3
_MOST_ENTRIES = 20
_DATE_LINES = 200_000  # searched for a date that tells whether the day or the month comes first


@dataclass(frozen=True, slots=True)
class TextSeen:
    """One text of a recording: its name in an archive, and what it is made of."""

    entry: str
    format: str


@dataclass(frozen=True, slots=True)
class RejectSeen:
    """A line that was not taken, in which text of an archive."""

    entry: str
    reject: Reject


@dataclass(slots=True)
class Preview:
    """What the first lines of a recording hold. `is_whole`: there are no more than these.

    `table` is what its first table seems to be, `mapping` how it is read; None without a table.
    `problem` says why nothing of it can be read yet, `left_out` which entries of an archive are
    no recordings.
    """

    texts: list[TextSeen] = field(default_factory=list)
    accounting: Accounting = field(default_factory=Accounting)
    reports: list[Report] = field(default_factory=list)
    rejects: list[RejectSeen] = field(default_factory=list)
    summary: RecordingSummary = field(default_factory=RecordingSummary)
    is_whole: bool = False
    table: Proposal | None = None
    mapping: TableMapping | None = None
    problem: str = ""
    left_out: list[LeftOut] = field(default_factory=list)

    @property
    def first(self) -> datetime | None:
        """The moment of the first report."""
        return self.summary.first

    @property
    def last(self) -> datetime | None:
        """The moment of the last report."""
        return self.summary.last

    @property
    def vessel_count(self) -> int:
        """How many vessels the portion speaks of."""
        return self.summary.vessel_count


def preview(
    stream: IO[bytes],
    *,
    max_bytes: int,
    mapping: TableMapping | None = None,
    most_lines: int = PREVIEW_LINES,
) -> Preview:
    """Decode the first lines of a recording without storing anything.

    Raises Invalid for what is no recording, TooLarge for an archive made to harm. A table whose
    columns nobody knows is no error: the preview says what is missing.
    """
    seen = Preview()
    of_reason: Counter[str] = Counter()

    def keep(entry: str, reject: Reject) -> None:
        of_reason[reject.reason] += 1
        if of_reason[reject.reason] <= REJECTS_OF_A_REASON:
            seen.rejects.append(RejectSeen(entry, reject))

    is_chosen = mapping is not None and bool(mapping.columns)
    recording = Recording(
        stream,
        max_bytes=max_bytes,
        mapping=mapping if is_chosen else None,
        on_reject=keep,
        date_lines=_DATE_LINES,
    )
    try:
        _look(seen, recording, mapping, most_lines)
    except NotARecordingError:
        if recording.unknown_table is None:
            raise
        _look_at_table(seen, recording.unknown_table, mapping)
    seen.left_out = recording.left_out
    return seen


def _look(
    seen: Preview, recording: Recording, mapping: TableMapping | None, most_lines: int
) -> None:
    seen.is_whole = True
    lines = 0
    for part in recording.texts():
        if len(seen.texts) == _MOST_ENTRIES:
            seen.is_whole = False
            break
        seen.texts.append(TextSeen(part.entry, part.format))
        if seen.table is None or (part.unsure_date and not seen.problem):
            _look_at_table(seen, part, mapping)
        if not seen.problem:
            _read(seen, part, most_lines - lines)
        lines += part.accounting.lines.total
        seen.accounting.add(part.accounting)
        if not part.is_read_out:
            seen.is_whole = False
            break


def _look_at_table(seen: Preview, part: Part, mapping: TableMapping | None) -> None:
    """Note what a part seems to be if it is a table, and how it is read."""
    table = part.proposal(mapping.delimiter if mapping else None)
    if table is None:
        return
    if part.mapping is not None:
        table = replace(table, mapping=part.mapping, unsure_date=part.unsure_date)
    seen.table, seen.mapping = table, mapping
    if mapping is None or not mapping.columns:
        seen.mapping = table.mapping
    if seen.mapping is not None and seen.mapping.missing:
        missing = ", ".join(seen.mapping.missing)
        seen.problem = f"No column is known as {missing}; say below which it is."
    elif part.unsure_date:
        seen.problem = (
            f"{part.unsure_date} may have the day or the month first, and no row tells which: "
            "choose below how the times are written."
        )


def _read(seen: Preview, part: Part, most_lines: int) -> None:
    for report in part.first_reports(most_lines):
        seen.summary.add(report)
        if len(seen.reports) < REPORTS_SHOWN:
            seen.reports.append(report)
