"""The whole way from text to reports, and its accounting."""

from datetime import UTC, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from app.domain.accounting import Accounting, MessageReject, SentenceReject
from app.domain.ais import PositionReport, StaticReport
from app.domain.nmea import NmeaDecoder, decode_lines
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, sentence, tag_block

NOON = datetime(2024, 5, 1, 12, 0, 5, tzinfo=UTC)


def at(seconds: float) -> str:
    """Return a tag block so many seconds after noon."""
    return tag_block(f"c:{int((NOON + timedelta(seconds=seconds)).timestamp() * 1000)}")


def test_reports_and_accounting_of_a_small_recording() -> None:
    """Each line, sentence and message of a recording is found in one bucket."""
    position = encoded(POSITION)[0]
    first, second = encoded(VOYAGE)
    decoder = NmeaDecoder()
    reports = list(
        decode_lines(
            [
                "# recorded in Hamburg",
                at(0) + position,
                at(1) + position,  # the same transmission, heard again
                at(31) + position,  # sent again, word for word
                at(31) + first,
                second,
                at(32) + first,  # its second part never comes
                at(33) + position[:-1] + "?",
                at(34) + encoded(POSITION, lat=91.0, lon=181.0)[0],
                at(35) + encoded(POSITION, mmsi=992_190_917)[0],
                at(36) + sentence("4" + "0" * 27),
                at(37) + sentence("1" + "0" * 20),
                position,  # without any time
            ],
            decoder,
        )
    )
    assert [type(report) for report in reports] == [PositionReport, PositionReport, StaticReport]
    assert decoder.accounting.balances
    assert decoder.accounting.as_dict() == {
        "lines": {"total": 13, "sentence": 12, "time_only": 0, "other": 1, "dropped": 0},
        "sentences": {
            "total": 12,
            "assembled": 10,
            "rejected": {"checksum": 1},
            "orphaned": 1,
            "pending": 0,
        },
        "messages": {
            "assembled": 9,
            "positions": 2,
            "statics": 1,
            "duplicates": 1,
            "ignored_type": 1,
            "rejected": {"mmsi_kind": 1, "payload_length": 1, "position": 1, "time": 1},
        },
    }


def test_live_input_is_dated_by_its_arrival() -> None:
    """A bare sentence from a feed is dated by the moment it came, and its second."""
    decoder = NmeaDecoder()
    (report,) = decoder.feed(encoded(POSITION)[0], arrival=NOON + timedelta(seconds=0.7))
    assert isinstance(report, PositionReport)
    assert report.fix_time == NOON
    assert report.received_at == NOON + timedelta(seconds=0.7)


def test_live_orphans_are_counted_as_time_goes_by() -> None:
    """An unfinished message of a feed becomes orphaned without waiting for the feed's end."""
    decoder = NmeaDecoder()
    decoder.feed(encoded(VOYAGE)[0], arrival=NOON)
    assert decoder.accounting.sentences.pending == 1
    decoder.feed("", arrival=NOON + timedelta(seconds=6))
    assert decoder.accounting.sentences.pending == 0
    assert decoder.accounting.sentences.orphaned == 1


def test_repeats_are_told_even_when_clocks_disagree() -> None:
    """Receivers whose clocks differ by an hour do not hide each other's repeats."""
    decoder = NmeaDecoder()
    mine, other = encoded(POSITION)[0], encoded(POSITION, mmsi=211_000_002)[0]
    for line in (at(0) + mine, at(3600) + other, at(2) + mine, at(3602) + other):
        decoder.feed(line)
    assert decoder.accounting.messages.positions == 2
    assert decoder.accounting.messages.duplicates == 2


def test_counts_of_several_inputs_add_up() -> None:
    """Accounting of two files is the sum of theirs, reasons included."""
    total = Accounting()
    for line in (encoded(POSITION)[0], "!AIVDM,broken"):
        decoder = NmeaDecoder()
        list(decode_lines([line], decoder))
        total.add(decoder.accounting)
    assert total.lines.sentence == 2
    assert total.messages.rejected == {MessageReject.TIME: 1}
    assert total.sentences.rejected == {SentenceReject.CHECKSUM: 1}
    assert total.balances


good_lines = st.sampled_from(
    [at(0) + line for line in [*encoded(POSITION), *encoded(VOYAGE), sentence("53:B", "3,2,1")]]
)


@given(st.lists(good_lines | st.text(max_size=40), max_size=40), st.data())
def test_the_sums_are_exact_for_any_input(lines: list[str], data: st.DataObject) -> None:
    """Cut, shuffled, joined and senseless lines all leave sums that are exact."""
    text = "\n".join(data.draw(st.permutations(lines)))
    cut = data.draw(st.integers(0, len(text)))
    decoder = NmeaDecoder()
    list(decode_lines(text[cut:].splitlines(), decoder))
    assert decoder.accounting.balances
    assert decoder.accounting.lines.total == len(text[cut:].splitlines())
