"""Accounting of AIS input: what became of every line, every sentence and every message.

An import that says "12,345 positions" hides what it lost. Here each line, sentence and message
falls into exactly one bucket, so three sums hold at the end of the input:

    lines     = sentence + time only + other + dropped
    sentences = assembled + rejected (by reason) + orphaned
    messages  = positions + statics + duplicates + ignored type + rejected (by reason)

While input still flows, fragments of unfinished messages are the difference of the second sum.
A row of a table counts as one line, one sentence and one message. A message that gives both a
position and statics (type 19, a table's row) counts as a position.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class SentenceReject(StrEnum):
    """Why a sentence was not taken."""

    CHECKSUM = "checksum"  # missing, or not that of the sentence
    SYNTAX = "syntax"
    LENGTH = "length"  # longer than any sentence can be
    FRAGMENT_COUNT = "fragment_count"  # more than nine parts, or part 3 of 2


class MessageReject(StrEnum):
    """Why an assembled message, or a table's row, was not taken."""

    PAYLOAD_LENGTH = "payload_length"  # not as many bits as its type has: truncated
    POSITION = "position"  # not available, or off the globe
    MMSI_KIND = "mmsi_kind"  # not a vessel
    TIME = "time"  # no plausible time came with it
    FIELD = "field"  # a table's cell that is no number


@dataclass(slots=True)
class LineCounts:
    """Lines by what they hold."""

    sentence: int = 0
    time_only: int = 0  # a tag block or `$PGHP` whose sentence stands on a later line
    other: int = 0  # blank, comment, other NMEA sentences, unreadable
    dropped: int = 0  # live input that came faster than it could be stored

    @property
    def total(self) -> int:
        """Lines seen."""
        return self.sentence + self.time_only + self.other + self.dropped


@dataclass(slots=True)
class SentenceCounts:
    """Sentences by their fate; `total` is counted apart, so that the sum is a check."""

    total: int = 0
    assembled: int = 0
    orphaned: int = 0
    rejected: Counter[SentenceReject] = field(default_factory=Counter)

    @property
    def pending(self) -> int:
        """Fragments that still wait for the rest of their message; 0 at the end of input."""
        return self.total - self.assembled - self.orphaned - self.rejected.total()


@dataclass(slots=True)
class MessageCounts:
    """Messages by their fate; `assembled` is counted apart, so that the sum is a check."""

    assembled: int = 0
    positions: int = 0
    statics: int = 0
    duplicates: int = 0
    ignored_type: int = 0
    rejected: Counter[MessageReject] = field(default_factory=Counter)

    @property
    def unexplained(self) -> int:
        """Messages without a bucket: always 0."""
        kept = self.positions + self.statics
        return self.assembled - kept - self.duplicates - self.ignored_type - self.rejected.total()


@dataclass(slots=True)
class Accounting:
    """The three sums of one input."""

    lines: LineCounts = field(default_factory=LineCounts)
    sentences: SentenceCounts = field(default_factory=SentenceCounts)
    messages: MessageCounts = field(default_factory=MessageCounts)

    @property
    def balances(self) -> bool:
        """Whether every sentence and message has its bucket (true at the end of any input)."""
        return self.sentences.pending == 0 and self.messages.unexplained == 0

    def add(self, other: "Accounting") -> None:
        """Add the counts of another input (several files, or a feed's next hour)."""
        for mine, theirs in (
            (self.lines, other.lines),
            (self.sentences, other.sentences),
            (self.messages, other.messages),
        ):
            for name in mine.__dataclass_fields__:
                setattr(mine, name, getattr(mine, name) + getattr(theirs, name))

    def as_dict(self) -> dict[str, dict[str, object]]:
        """Return the counts as JSON: three objects `lines`, `sentences`, `messages`."""
        lines, sentences, messages = self.lines, self.sentences, self.messages
        return {
            "lines": {
                "total": lines.total,
                "sentence": lines.sentence,
                "time_only": lines.time_only,
                "other": lines.other,
                "dropped": lines.dropped,
            },
            "sentences": {
                "total": sentences.total,
                "assembled": sentences.assembled,
                "rejected": _by_reason(sentences.rejected),
                "orphaned": sentences.orphaned,
                "pending": sentences.pending,
            },
            "messages": {
                "assembled": messages.assembled,
                "positions": messages.positions,
                "statics": messages.statics,
                "duplicates": messages.duplicates,
                "ignored_type": messages.ignored_type,
                "rejected": _by_reason(messages.rejected),
            },
        }


def _by_reason(
    counts: Mapping[SentenceReject, int] | Mapping[MessageReject, int],
) -> dict[str, int]:
    return {reason.value: count for reason, count in sorted(counts.items()) if count}
