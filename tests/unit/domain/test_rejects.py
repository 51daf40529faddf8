"""Which lines were not taken: told one by one, as many as are counted."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.rejects import ORPHANED, Reject, RejectLog
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, sentence, tag_block

AT = tag_block("c:1714564806")
GOOD = AT + encoded(POSITION)[0]
FIRST, SECOND = encoded(VOYAGE)


def rejects_of(lines: list[str]) -> tuple[list[Reject], NmeaDecoder]:
    """Decode lines; return what was told, and the decoder."""
    told: list[Reject] = []
    decoder = NmeaDecoder(rejects=RejectLog(told.append))
    list(decode_lines(lines, decoder))
    return told, decoder


def test_each_reject_is_told_with_its_line() -> None:
    """A bad checksum, an orphan and a message without a time are told where they stand."""
    lines = ["# log", GOOD, AT + FIRST, GOOD[:-1] + "?", encoded(POSITION)[0], AT + "x" + GOOD]
    told, _ = rejects_of(lines)
    assert [(reject.line, reject.reason) for reject in told] == [
        (4, "checksum"),
        (5, "time"),
        (3, ORPHANED),
    ]
    assert told[2].text.decode() == lines[2]
    assert "other parts" in told[2].message


def test_parts_that_contradict_each_other_are_all_told() -> None:
    """Where two texts claim to be the same part, all of them are told, each once."""
    other = sentence("53:B", f"2,1,{FIRST.split(',')[3]}", tag=FIRST[1:6])
    told, decoder = rejects_of([AT + FIRST, AT + other, AT + SECOND])
    assert sorted(reject.line for reject in told) == [1, 2, 3]
    assert decoder.accounting.sentences.orphaned == 3


@given(
    st.lists(
        st.sampled_from([GOOD, AT + FIRST, AT + SECOND, sentence("53:B", "3,2,1")])
        | st.text(max_size=30),
        max_size=40,
    ),
    st.integers(0, 2_000),
)
def test_as_many_are_told_as_are_counted(lines: list[str], cut: int) -> None:
    """For any input, reasons told and reasons counted are the same, line by line within it."""
    rest = "\n".join(lines)[cut:].splitlines()
    told, decoder = rejects_of(rest)
    sentences, messages = decoder.accounting.sentences, decoder.accounting.messages
    counted = Counter({reason.value: count for reason, count in sentences.rejected.items()})
    counted.update({reason.value: count for reason, count in messages.rejected.items()})
    counted[ORPHANED] = sentences.orphaned
    assert Counter(reject.reason for reject in told) == +counted
    assert all(rest[reject.line - 1].encode() == reject.text for reject in told)
