"""Parts into messages, never mixed."""

from datetime import UTC, datetime, timedelta
from itertools import permutations

import pytest

from app.domain.accounting import SentenceCounts
from app.domain.nmea_assembly import FragmentAssembler
from app.domain.nmea_lines import Sentence

NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)


def part(
    text: str,
    number: int,
    count: int = 2,
    source: str = "",
    at_s: float | None = 0.0,
    sequence: str = "3",
) -> Sentence:
    """One part of a message, `at_s` seconds after noon or without a time."""
    received_at = None if at_s is None else NOON + timedelta(seconds=at_s)
    return Sentence(
        source.encode(),
        b"AIVDM",
        b"A",
        sequence.encode(),
        count,
        number,
        text.encode(),
        0,
        received_at,
    )


class Assembly:
    """An assembler that remembers what it was given and what it made."""

    def __init__(self, *parts: Sentence) -> None:
        self.counts = SentenceCounts()
        self.assembler = FragmentAssembler(self.counts)
        self.made: list[str] = []
        for one in parts:
            self.add(one)

    def add(self, one: Sentence, arrival: datetime | None = None) -> None:
        """Give it one part."""
        self.counts.total += 1
        message = self.assembler.add(one, arrival)
        if message is not None:
            self.made.append(message[0].decode())

    def end(self) -> "Assembly":
        """End the input."""
        self.assembler.finish()
        return self


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_parts_come_in_any_order(order: tuple[int, ...]) -> None:
    """A message is whole when its last missing part comes, and its parts are in their order."""
    parts = [part("a", 1, 3), part("b", 2, 3), part("c", 3, 3)]
    assert Assembly(*(parts[i] for i in order)).made == ["abc"]


def test_a_message_is_dated_by_its_earliest_part() -> None:
    """The reception of a message is that of the part that came first."""
    assembly = Assembly(part("a", 1, at_s=2.0))
    message = assembly.assembler.add(part("b", 2, at_s=1.0))
    assert message is not None
    assert message[2] == NOON + timedelta(seconds=1)


def test_two_receivers_interleaved() -> None:
    """Parts with the same sequence number from two sources do not mix."""
    assembly = Assembly(
        part("a", 1, source="x"),
        part("c", 1, source="y"),
        part("b", 2, source="x"),
        part("d", 2, source="y"),
    )
    assert assembly.made == ["ab", "cd"]


def test_a_part_without_a_source_follows_the_youngest_message() -> None:
    """The second line after a `$PGHP`, which has no station of its own, belongs to the last."""
    assembly = Assembly(part("a", 1, source="x"), part("c", 1, source="y"), part("d", 2, at_s=None))
    assert assembly.made == ["cd"]


def test_two_copies_of_a_message_are_both_made() -> None:
    """The same parts heard twice make the message twice (a repeat, dropped later)."""
    assembly = Assembly(part("a", 1), part("a", 1), part("b", 2), part("b", 2)).end()
    assert assembly.made == ["ab", "ab"]
    assert assembly.counts.orphaned == 0


def test_contradicting_parts_are_given_up() -> None:
    """Where two texts claim to be the same part, nothing is made of any of them."""
    assembly = Assembly(part("a", 1), part("c", 1), part("b", 2), part("d", 2)).end()
    assert assembly.made == []
    assert assembly.counts.orphaned == 4


def test_a_late_part_does_not_complete_an_old_message() -> None:
    """After 5 s a sequence number belongs to another message."""
    assembly = Assembly(part("a", 1, at_s=0), part("d", 2, at_s=5.1), part("c", 1, at_s=5.2)).end()
    assert assembly.made == ["cd"]
    assert assembly.counts.orphaned == 1


def test_without_times_a_hundred_sentences_expire_a_part() -> None:
    """In a recording without times, distance in sentences stands in for seconds."""
    single = part("s", 1, count=1, at_s=None)
    near = Assembly(part("a", 1, at_s=None), *[single] * 99, part("b", 2, at_s=None))
    far = Assembly(part("a", 1, at_s=None), *[single] * 100, part("b", 2, at_s=None))
    assert near.made.count("ab") == 1
    assert far.made.count("ab") == 0


def test_live_orphans_expire_by_the_clock() -> None:
    """On a feed, an unfinished message is counted as orphaned five seconds after its arrival."""
    assembly = Assembly()
    assembly.add(part("a", 1), arrival=NOON)
    assembly.assembler.expire(NOON + timedelta(seconds=4))
    assert assembly.counts.orphaned == 0
    assembly.assembler.expire(NOON + timedelta(seconds=6))
    assert assembly.counts.orphaned == 1


def test_orphans_take_bounded_memory() -> None:
    """A flood of first parts pushes the oldest out, and each is counted."""
    assembly = Assembly(*(part("a", 1, source=str(n)) for n in range(5000)))
    assert assembly.counts.pending == 4096
    assert assembly.counts.orphaned == 5000 - 4096
    assert assembly.end().counts.pending == 0
