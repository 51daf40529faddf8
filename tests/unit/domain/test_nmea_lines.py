"""Lines into checked sentences with their times."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.accounting import LineCounts, SentenceCounts, SentenceReject
from app.domain.nmea_lines import LONGEST_LINE, LineReader, Sentence, split_lines
from app.domain.nmea_times import TimeReader
from tests.factories.nmea_text import pghp, sentence, tag_block

GOOD = sentence("13:BuN001=15mQFOjcOBG1p800SK")
ARRIVAL = datetime(2024, 5, 1, 13, 0, tzinfo=UTC)
NOON_6_25 = datetime(2024, 5, 1, 12, 0, 6, 250_000, tzinfo=UTC)
EPOCH = datetime(2013, 3, 26, 4, 32, 52, tzinfo=UTC)


class Reading:
    """What a reader made of some lines."""

    def __init__(self, *lines: str) -> None:
        self.lines, self.sentences = LineCounts(), SentenceCounts()
        reader = LineReader(self.lines, self.sentences, TimeReader())
        self.good: list[Sentence] = []
        for line in lines:
            self.good += reader.read(line.encode("latin-1"), ARRIVAL)

    @property
    def times(self) -> list[datetime | None]:
        """The reception times of the good sentences."""
        return [sentence.received_at for sentence in self.good]


@pytest.mark.parametrize("tag", ["AIVDM", "BSVDM", "ABVDM", "ANVDM", "SAVDM", "AIVDO", "--VDM"])
def test_every_talker_is_heard(tag: str) -> None:
    """Base stations, satellites and the own ship speak in the same sentence as AIVDM."""
    reading = Reading(sentence("13:BuN001=15mQFOjcOBG1p800SK", tag=tag))
    assert [found.tag.decode() for found in reading.good] == [tag]


@pytest.mark.parametrize(
    ("lines", "time"),
    [
        ([GOOD], ARRIVAL),
        ([tag_block("c:1364272372") + GOOD], EPOCH),
        ([tag_block("c:1364272372"), GOOD], EPOCH),
        ([tag_block("s:x"), pghp(), GOOD], NOON_6_25),
        ([pghp(), "", "# a comment", GOOD], NOON_6_25),
        (["2013-03-26T04:32:52Z " + GOOD], EPOCH),
        (["  1364272372 " + GOOD], EPOCH),
        (['"2013-03-26 04:32:52","' + GOOD + '"'], EPOCH),
        ([GOOD + ",1364272372"], EPOCH),
        # As loggers write them: syslog, spreadsheets, AIS-catcher's remark, compact dates.
        (["<14>1 2013-03-26T04:32:52.000Z host ais - - - " + GOOD], EPOCH),
        (["[2013/03/26 04:32:52] " + GOOD], EPOCH),
        (["20130326T043252Z " + GOOD], EPOCH),
        (["20130326-043252 " + GOOD], EPOCH),
        ([GOOD + " ( MSG: 1, MMSI: 230907000, ppm: 0, timestamp: 20130326043252)"], EPOCH),
        (['"' + GOOD + '","2013-03-26 05:32:52+01:00"'], EPOCH),
        ([GOOD + "\t1364272372"], EPOCH),
        # A date whose day or month comes first in another land, or without a year: no date.
        (["03/04/2013 04:32:52 " + GOOD], ARRIVAL),
        (["Mar 26 04:32:52 host ais: " + GOOD], ARRIVAL),
        # A tag block whose checksum is wrong says nothing.
        (["\\c:1364272372*00\\" + GOOD], ARRIVAL),
        # The best of several: tag block, $PGHP, prefix, suffix.
        ([pghp(), tag_block("c:1364272372") + GOOD + ",1714564000"], EPOCH),
        ([pghp(), "1364272372 " + GOOD], NOON_6_25),
        (["1364272372 " + GOOD + ",1714564000"], EPOCH),
        # A tag block without a plausible time leaves the choice to the others.
        ([pghp(), tag_block("c:12415440354") + GOOD], NOON_6_25),
    ],
)
def test_time_precedence(lines: list[str], time: datetime) -> None:
    """Each sentence gets the best of the times that came with it."""
    assert Reading(*lines).times == [time]


def test_a_carried_time_serves_one_sentence() -> None:
    """A `$PGHP` line dates the sentence after it and no other."""
    assert Reading(pghp(), GOOD, GOOD).times == [NOON_6_25, ARRIVAL]


def test_a_carried_time_is_not_handed_past_another_sentence() -> None:
    """A `$PGHP` line that belonged to a proprietary sentence does not date the next AIS one."""
    assert Reading(pghp(), "$PSTT,30A,20131112,120003*6E", GOOD).times == [ARRIVAL]


def test_two_sentences_on_one_line() -> None:
    """Both sentences of a line are taken, each with its own tag block."""
    line = tag_block("s:a,c:1364272372") + GOOD + tag_block("s:b") + GOOD
    reading = Reading(line)
    assert [(s.source, s.received_at) for s in reading.good] == [(b"a", EPOCH), (b"b", ARRIVAL)]
    assert (reading.lines.sentence, reading.sentences.total) == (1, 2)


def test_sources_of_a_tag_block_group() -> None:
    """Later sentences of a group have the source and the time that its first one told."""
    reading = Reading(
        tag_block("g:1-2-7,s:a,c:1364272372") + GOOD,
        tag_block("g:1-2-8,s:b") + GOOD,
        tag_block("g:2-2-7") + GOOD,
        tag_block("g:2-2-8") + GOOD,
    )
    assert [s.source for s in reading.good] == [b"a", b"b", b"a", b"b"]
    assert reading.times == [EPOCH, ARRIVAL, EPOCH, ARRIVAL]


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (GOOD[:-1] + ("0" if GOOD[-1] != "0" else "1"), SentenceReject.CHECKSUM),
        (GOOD[:-3], SentenceReject.CHECKSUM),
        (GOOD.replace("13:Bu", "13:Bv"), SentenceReject.CHECKSUM),
        (sentence("13:Bu~001=15mQFOjcOBG1p800SK"), SentenceReject.SYNTAX),
        (sentence("13:BuN001=15mQFOjcOBG1p800SK", fill=7), SentenceReject.SYNTAX),
        (sentence("13:BuN001=15mQFOjcOBG1p800SK", part="x,1,"), SentenceReject.SYNTAX),
        (sentence("53:B", part="2,1,3", fill=2), SentenceReject.SYNTAX),
        (sentence("0" * 300), SentenceReject.LENGTH),
        (sentence("53:B", part="2,3,1"), SentenceReject.FRAGMENT_COUNT),
        (sentence("53:B", part="2,0,1"), SentenceReject.FRAGMENT_COUNT),
        (sentence("53:B", part="12,1,1"), SentenceReject.FRAGMENT_COUNT),
        (sentence("53:B", part="0,0,"), SentenceReject.FRAGMENT_COUNT),
    ],
)
def test_bad_sentences_are_rejected_by_reason(line: str, reason: SentenceReject) -> None:
    """A damaged or impossible sentence is never taken, and counted under its reason."""
    reading = Reading(line)
    assert reading.good == []
    assert dict(reading.sentences.rejected) == {reason: 1}


def test_a_damaged_sentence_does_not_cost_its_neighbour() -> None:
    """On a shared line, the good sentence is taken beside the bad one."""
    reading = Reading(GOOD.replace("13:Bu", "13:Bv") + GOOD)
    assert len(reading.good) == 1
    assert reading.sentences.rejected[SentenceReject.CHECKSUM] == 1


def test_lines_are_told_apart() -> None:
    """Sentence lines, time-only lines and others are counted, each line once."""
    lines = Reading(
        GOOD, pghp(), tag_block("s:x"), "", "# no", "foobar", "$GPRMC,x*00", "!AIVDX,1*00"
    ).lines
    assert (lines.sentence, lines.time_only, lines.other, lines.total) == (1, 2, 5, 8)


def test_an_endless_line_is_one_unreadable_line() -> None:
    """A line beyond the limit is counted as other, whatever it holds."""
    reading = Reading("x" * LONGEST_LINE + GOOD)
    assert (reading.lines.other, reading.sentences.total) == (1, 0)


@given(
    st.lists(st.binary(max_size=60).map(lambda b: b.replace(b"\n", b"")), max_size=20), st.data()
)
def test_split_lines_does_not_depend_on_the_chunks(lines: list[bytes], data: st.DataObject) -> None:
    """Lines come out the same however the bytes were cut on their way."""
    text = b"\n".join(lines)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(text)), max_size=6)))
    chunks = [text[a:b] for a, b in zip([0, *cuts], [*cuts, len(text)], strict=True)]
    expected = text.split(b"\n")
    if not expected[-1]:
        expected.pop()
    assert list(split_lines(chunks)) == expected


def test_split_lines_holds_an_endless_line_in_bounded_memory() -> None:
    """A stream without line ends yields one cut line, and the next line is whole again."""
    chunks = [b"x" * 1000] * 50 + [b"x\nnext\n"]
    lines = list(split_lines(chunks))
    assert [len(line) for line in lines] == [LONGEST_LINE + 1, 4]


@given(st.text(max_size=120))
def test_no_line_breaks_the_reader(text: str) -> None:
    """Any text is read into good or rejected sentences that add up."""
    reading = Reading(text.encode().decode("latin-1"))
    assert reading.sentences.total == len(reading.good) + reading.sentences.rejected.total()
