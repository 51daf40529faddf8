"""Times around sentences."""

from datetime import UTC, datetime
from functools import reduce
from operator import xor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.nmea_times import TimeReader, xor_checksum

TIMES = TimeReader(not_after=datetime(2030, 1, 1, tzinfo=UTC))


@given(st.binary(max_size=300))
def test_checksum_is_the_xor_of_all_bytes(body: bytes) -> None:
    """Folding gives the same checksum as XORing byte by byte, at any length."""
    assert xor_checksum(body) == reduce(xor, body, 0)


def block(content: str) -> bytes:
    """Return a tag block with a right checksum."""
    return f"\\{content}*{reduce(xor, content.encode(), 0):02x}\\".encode()


def test_tag_block_of_a_recording() -> None:
    """A recorded tag block gives its time, and its source with all colons in it."""
    tag = TIMES.tag_blocks(rb"\s:b:2,c:1364272372*57\!AIVDM,")
    assert tag is not None
    assert (tag.time, tag.source) == (datetime(2013, 3, 26, 4, 32, 52, tzinfo=UTC), b"b:2")


@pytest.mark.parametrize(
    ("c", "time"),
    [
        ("1364272372", datetime(2013, 3, 26, 4, 32, 52, tzinfo=UTC)),
        ("1364272372000", datetime(2013, 3, 26, 4, 32, 52, tzinfo=UTC)),
        ("1364272372250", datetime(2013, 3, 26, 4, 32, 52, 250_000, tzinfo=UTC)),
        ("1364272372.5", datetime(2013, 3, 26, 4, 32, 52, 500_000, tzinfo=UTC)),
        ("12415440354", None),  # a public sample: the year 2363
        ("1999999999", None),  # later than not_after
        ("0", None),
        ("-5", None),
        ("12x", None),
        ("9" * 400, None),
    ],
)
def test_seconds_and_milliseconds_are_told_apart(c: str, time: datetime | None) -> None:
    """Key c counts in seconds or milliseconds, and an implausible epoch is no time."""
    tag = TIMES.tag_blocks(block(f"s:x,c:{c}"))
    assert tag is not None
    assert tag.time == time


def test_a_tag_block_with_a_wrong_checksum_is_ignored() -> None:
    """A damaged tag block gives neither time nor source."""
    assert TIMES.tag_blocks(b"\\s:b:2,c:1364272373*57\\") is None


def test_group_is_read() -> None:
    """Key g names the group by its third number."""
    tag = TIMES.tag_blocks(block("g:1-2-1604,s:x"))
    assert tag is not None
    assert tag.group == b"1604"


def test_pghp_of_a_recording() -> None:
    """A recorded `$PGHP` line gives UTC to the millisecond, and its station."""
    pghp = TIMES.pghp(b"$PGHP,1,2013,11,12,12,0,0,26,219,,2190074,1,67*25")
    assert pghp is not None
    assert pghp.time == datetime(2013, 11, 12, 12, 0, 0, 26_000, tzinfo=UTC)
    assert pghp.station == b"219,,2190074"


@pytest.mark.parametrize(
    "line",
    [
        b"$PGHP,1,2013,11,12,12,0,0,27,219,,2190074,1,67*25",
        b"$PGHP,1,2013,13,12*00",
        b"$PGHP,",
        b"$PGHP,1,a,b,c,d,e,f,g,h*zz",
    ],
)
def test_damaged_pghp_is_none(line: bytes) -> None:
    """A wrong checksum or a date that does not exist makes a `$PGHP` line unreadable."""
    assert TIMES.pghp(line) is None


@pytest.mark.parametrize(
    ("text", "time"),
    [
        (b"2024-05-01T12:00:06Z ", datetime(2024, 5, 1, 12, 0, 6, tzinfo=UTC)),
        (b"2024-05-01 12:00:06.25;", datetime(2024, 5, 1, 12, 0, 6, 250_000, tzinfo=UTC)),
        (b"2024-05-01T14:00:06+02:00,", datetime(2024, 5, 1, 12, 0, 6, tzinfo=UTC)),
        (b"2024-05-01T09:30:06-0230 ", datetime(2024, 5, 1, 12, 0, 6, tzinfo=UTC)),
        (b'"1714564806","', datetime(2024, 5, 1, 12, 0, 6, tzinfo=UTC)),
        (b"1714564806.5 ", datetime(2024, 5, 1, 12, 0, 6, 500_000, tzinfo=UTC)),
        (b"  1714564806500 ", datetime(2024, 5, 1, 12, 0, 6, 500_000, tzinfo=UTC)),
        (b"2024-13-01T12:00:06Z ", None),
        (b"9999-12-31T23:59:59-10:00 ", None),
        (b"station 42 ", None),
    ],
)
def test_prefixes(text: bytes, time: datetime | None) -> None:
    """ISO dates (with or without a zone) and epochs before a sentence are read."""
    assert TIMES.prefix(text) == time


@pytest.mark.parametrize(
    ("text", "epoch"),
    [
        (b",1412524603", 1412524603),
        (b",d-109,S2105,t050056.00,T56.13,r003669946,1325394060,1325394001", 1325394060),
        (b",1daasd4218,,1357134222", 1357134222),
        (b",1412524603\r", 1412524603),
        (b",1", None),
    ],
)
def test_suffixes(text: bytes, epoch: int | None) -> None:
    """The first plausible epoch after the checksum is the reception."""
    expected = None if epoch is None else datetime.fromtimestamp(epoch, UTC)
    assert TIMES.suffix(text) == expected


@pytest.mark.parametrize("year", ["99999999999", "2013" * 9])
def test_a_number_beyond_all_bounds_is_no_time(year: str) -> None:
    """A damaged line may have the right checksum by chance, and a year that no date can hold."""
    body = f"PGHP,1,{year},11,12,12,0,0,26,219,,2190074,1,67".encode()
    assert TIMES.pghp(b"$%b*%02X" % (body, xor_checksum(body))) is None


@given(st.binary(max_size=80))
def test_no_bytes_break_the_reader(text: bytes) -> None:
    """Whatever stands around a sentence, reading its time answers and never fails."""
    TIMES.tag_blocks(b"\\" + text)
    TIMES.pghp(b"$PGHP," + text)
    TIMES.prefix(text)
    TIMES.suffix(text)
