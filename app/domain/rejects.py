"""Which lines were not taken, and why: for whoever wants to see them, not for whoever counts.

A recording's accounting says how many sentences had a wrong checksum. To mend a receiver one wants
to see them. Keeping all would need memory without bound, so a reject is told the moment it is
known, with its line, and forgotten. Counting goes on as ever: the counters themselves tell, so
what is told and what is counted cannot differ.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, TypeVar

from app.domain.accounting import (
    Accounting,
    MessageCounts,
    MessageReject,
    SentenceCounts,
    SentenceReject,
)

ORPHANED = "orphaned"
Reason = TypeVar("Reason", bound=StrEnum)

# What a person reads for each reason.
MEANINGS: dict[str, str] = {
    SentenceReject.CHECKSUM: "the checksum is missing or not that of the sentence",
    SentenceReject.SYNTAX: "the sentence is damaged",
    SentenceReject.LENGTH: "longer than any sentence can be",
    SentenceReject.FRAGMENT_COUNT: "parts of a message that cannot be, such as part 3 of 2",
    ORPHANED: "the other parts of the message are missing",
    MessageReject.PAYLOAD_LENGTH: "not as many bits as this type of message has: cut off",
    MessageReject.POSITION: "no position: not available, or off the globe",
    MessageReject.MMSI_KIND: "not a vessel but a station, a buoy, an aircraft or a distress beacon",
    MessageReject.TIME: "no plausible time came with it",
    MessageReject.FIELD: "a cell cannot be read",
}


class Origin(NamedTuple):
    """Where something stood: the line, counted from 1, and its text."""

    line: int
    text: bytes


@dataclass(frozen=True, slots=True)
class Reject:
    """A line with a sentence, a message or a row that was not taken."""

    line: int
    reason: str  # of `SentenceReject` or `MessageReject`, or `ORPHANED`
    text: bytes
    message: str  # what is wrong, and for a row what to do


class RejectLog:
    """Tells each reject of one input as it becomes known."""

    def __init__(self, tell: Callable[[Reject], None]) -> None:
        self._tell = tell
        self._origin = Origin(0, b"")

    def at(self, text: bytes) -> Origin:
        """Go on to the next line."""
        self._origin = Origin(self._origin.line + 1, text)
        return self._origin

    def accounting(self) -> Accounting:
        """Return counters that tell of each reject at the present line."""
        return Accounting(
            sentences=SentenceCounts(rejected=_Telling(self._here)),
            messages=MessageCounts(rejected=_Telling(self._here)),
        )

    def orphaned(self, origin: Origin) -> None:
        """Tell of a part whose message never became whole."""
        self._tell(Reject(origin.line, ORPHANED, origin.text, MEANINGS[ORPHANED]))

    def row(self, reason: MessageReject, message: str) -> None:
        """Tell of a row of a table at the present line, with what to do."""
        self._tell(Reject(self._origin.line, reason.value, self._origin.text, message))

    def _here(self, reason: StrEnum) -> None:
        self._tell(Reject(self._origin.line, reason.value, self._origin.text, MEANINGS[reason]))


class _Telling(Counter[Reason]):
    """A counter that tells whatever raises one of its counts by one."""

    def __init__(self, tell: Callable[[Reason], None]) -> None:
        super().__init__()
        self._tell = tell

    def __setitem__(self, reason: Reason, count: int) -> None:
        super().__setitem__(reason, count)
        self._tell(reason)
