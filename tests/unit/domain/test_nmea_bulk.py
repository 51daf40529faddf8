"""The decoder in bulk against the reference and against pyais, report by report."""

import gzip
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyais import decode as pyais_decode

from app.domain.accounting import Accounting
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import (
    ACCURACIES,
    AIS_CLASSES,
    POSITION_LETTERS,
    SOURCES,
    PositionBits,
    PositionTable,
)
from app.domain.ais_payload import RejectedMessageError, decode_payload
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.nmea_bulk import decode_recording
from app.domain.nmea_lines import LONGEST_LINE, split_blocks, split_lines
from app.domain.nmea_times import moment_of
from app.domain.payload_bits import letters_of
from app.domain.static_bulk import StaticBits
from app.domain.static_table import StaticTable
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, pghp, sentence, tag_block

RECORDINGS = (
    "dma_212123000_14h_pghp.ais",
    "dma_219165000_22min_pghp_and_suffix.ais",
    "dma_5min_2013-11-12_pghp.nmea.gz",
    "dma_aislib_bare_aivdm.txt",
    "dma_aislib_replay_21s_pghp.txt",
    "dma_aislib_small_mixed_tagblocks.txt",
    "dma_aislib_stream_29s_pghp.txt",
    "libais_tagblock_groups.nmea",
    "libais_typeexamples_uscg_suffix.nmea",
    "pyais_mixed.txt",
    "pyais_nmea_data_sample.txt",
    "signalk_nais300_bare.log",
)
Outcome = tuple[Counter[PositionReport | StaticReport], Accounting]


def rows(table: PositionTable) -> Iterable[PositionReport]:
    """Return a table's rows as reports."""
    columns = {name: getattr(table, name).tolist() for name in table.__dataclass_fields__}
    for name in ("sog_kn", "cog_deg", "heading_deg", "rot_deg_min"):
        columns[name] = [None if math.isnan(value) else value for value in columns[name]]
    for name, meanings in (
        ("ais_class", AIS_CLASSES),
        ("high_accuracy", ACCURACIES),
        ("fix_time_source", SOURCES),
    ):
        columns[name] = [meanings[code] for code in columns[name]]
    columns["fix_time"] = list(map(moment_of, columns.pop("fix_us")))
    columns["received_at"] = list(map(moment_of, columns.pop("received_us")))
    for values in zip(*columns.values(), strict=True):
        yield PositionReport(**dict(zip(columns, values, strict=True)))


def static_rows(table: StaticTable) -> Iterable[StaticReport]:
    """Return a table's rows as reports."""
    columns = {name: getattr(table, name).tolist() for name in table.__dataclass_fields__}
    columns["received_at"] = list(map(moment_of, columns.pop("received_us")))
    for values in zip(*columns.values(), strict=True):
        said = dict(zip(columns, values, strict=True))
        sizes = {n: None for n, v in said.items() if isinstance(v, float) and math.isnan(v)}
        yield StaticReport(**(said | sizes))


def in_bulk(chunks: Sequence[bytes]) -> Outcome:
    """Decode in bulk."""
    decoder = NmeaDecoder()
    reports: Counter[PositionReport | StaticReport] = Counter()
    for decoded in decode_recording(chunks, decoder):
        if isinstance(decoded, PositionTable):
            reports.update(rows(decoded))
        elif isinstance(decoded, StaticTable):
            reports.update(static_rows(decoded))
        else:
            reports.update([decoded])
    return reports, decoder.accounting


def line_by_line(chunks: Sequence[bytes]) -> Outcome:
    """Decode with the reference."""
    decoder = NmeaDecoder()
    return Counter(decode_lines(split_lines(chunks), decoder)), decoder.accounting


def cut(text: bytes, every: int) -> list[bytes]:
    """Return a text as it comes from a file, in chunks."""
    return [text[start : start + every] for start in range(0, len(text), every)]


@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_come_out_alike(shared_dir: Path, name: str) -> None:
    """On every real recording both ways give the same reports and the same accounting."""
    data = (shared_dir / "real/ais" / name).read_bytes()
    chunks = cut(gzip.decompress(data) if name.endswith(".gz") else data, 200_000)
    assert in_bulk(chunks) == line_by_line(chunks)


POSITION_LINE = encoded(POSITION)[0]
TIMES = [
    tag_block("s:x,c:1714564805"),
    tag_block("c:1714564806250,s:b:2,T:12.5") + "\r\n",
    tag_block("si:AISD") + "\n" + pghp() + "\n",
    tag_block("c:1714564805") + "\n" + pghp() + "\n",
    tag_block("g:1-2-77,s:x,c:1714564805"),
    tag_block("c:12415440354"),
    tag_block("s:1714564805"),
    tag_block("c:1714564805")[:-3] + "FF\\",
    pghp() + "\n",
    pghp("2024,2,30,12,0,6,250") + "\n",
    pghp("0000,2,3,12,0,6,250") + "\n",
    pghp("1999,2,3,12,0,6,250") + "\n",
    "2024-05-01T12:00:06Z ",
    "1714564805 ",
    "",
]
SENTENCES = [
    POSITION_LINE,
    POSITION_LINE,
    encoded(POSITION, msg_type=18, mmsi=211_000_002, second=60)[0],
    encoded(POSITION, second=59)[0],
    encoded(POSITION, lat=91.0)[0],
    encoded(POSITION, mmsi=992_190_917)[0],
    encoded({"msg_type": 24, "mmsi": 211_000_003, "partno": 0, "shipname": "ELBE"})[0],
    *encoded(VOYAGE),
    POSITION_LINE.replace("A,", "B,", 1),  # a wrong checksum
    POSITION_LINE + POSITION_LINE,
    sentence("4" + "0" * 27),
    sentence("1" + "0" * 20),
    sentence("1" + "0" * 27, fill=2),
    sentence("53:B", "3,2,1"),
    "$GPRMC,x*00",
    "# a comment",
    "x" * (LONGEST_LINE + 1),
    "",
]
FIRST, SECOND = encoded(VOYAGE)
SENTENCES += [
    f"{FIRST}\n{SECOND}",
    f"{FIRST}\r\n{SECOND}",
    f"{FIRST}\n{SECOND},1714564807",
    f"{FIRST},1714564806\n{SECOND},1714564899",
    *(
        f"{FIRST}\n{tag_block(told)}{SECOND}"
        for told in (
            "s:x,c:1714564805",
            "c:1714564809",
            "c:1714564811",
            "s:y,c:1714564805",
            "s:x",
            "g:2-2-77,c:1714564805",
            "c:12415440354",
        )
    ),
    f"{FIRST}\n{tag_block('c:1714564805')[:-3]}FF\\{SECOND}",
    f"{FIRST}\n{SECOND[:-1]}{'1' if SECOND[-1] == '0' else '0'}",
    f"{FIRST}\n{SECOND.replace(',A,', ',B,')}",
    FIRST.replace(",0*", ",2*"),
    encoded({"msg_type": 24, "mmsi": 211_000_003, "partno": 1, "callsign": "DABC"})[0],
    encoded({"msg_type": 24, "mmsi": 982_110_003, "partno": 1, "mothership_mmsi": 211_000_003})[0],
]
VOYAGE_LINES = [line + "\n" for line in encoded(VOYAGE)]
ENDS = ["\n", "\r\n", ",1714564807\n", ",1714564807,x\r\n", " \n", ""]


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(TIMES), st.sampled_from(SENTENCES), st.sampled_from(ENDS)).map(
            "".join
        )
        | st.text(max_size=20),
        max_size=30,
    ),
    st.integers(1, 3000),
    st.integers(0, 60),
)
# A time on its way to the next sentence, within a block and from one to the next.
@example([TIMES[4] + "\n", POSITION_LINE + ",1714564807\n"], 3000, 0)
@example([TIMES[0] + "\n", POSITION_LINE + ",1714564807\n"], len(TIMES[0]) + 1, 0)
# A sentence cut off where the text ends, and a line too short for what its first letter promises.
@example([TIMES[0] + POSITION_LINE[:20]], 3000, 0)
@example([TIMES[0] + POSITION_LINE + "\n", "$"], 3000, 0)
@example(["$\n", "$P\n", "\\\n", "!\n", TIMES[0] + POSITION_LINE + "\n"], 3000, 0)
# The memory of repeats and the parts of a message across what is read in bulk.
@example([TIMES[0] + POSITION_LINE + "\n", POSITION_LINE + ",1714564807,x\n"] * 2, 3000, 0)
@example([*VOYAGE_LINES[:1], *[POSITION_LINE + ",1714564807\n"] * 100, *VOYAGE_LINES[1:]], 9000, 0)
def test_any_text_comes_out_alike(lines: list[str], chunk_bytes: int, start: int) -> None:
    """However lines, times and damage follow each other, both ways give and count the same."""
    chunks = cut("".join(lines).encode()[start:], chunk_bytes)
    assert in_bulk(chunks) == line_by_line(chunks)


letters = st.sampled_from([chr(code) for code in (*range(48, 88), *range(96, 120))])
payloads = st.tuples(st.sampled_from("123B"), st.lists(letters, min_size=27, max_size=27)).map(
    lambda drawn: drawn[0] + "".join(drawn[1])
)


@settings(deadline=None)
@given(st.lists(payloads, min_size=1, max_size=20), st.integers(10**15, 2 * 10**15))
@example(["1" + "0" * 27, "B" + "w" * 27], 10**15)
def test_payloads_mean_what_the_reference_says(drawn: list[str], received_us: int) -> None:
    """Of any bits, those are usable that the reference takes, and every field is the same."""
    bits = PositionBits(letters_of([payload.encode() for payload in drawn], POSITION_LETTERS))
    chosen = np.flatnonzero(bits.usable)
    table = bits.table(chosen, np.full(chosen.size, received_us))
    expected = []
    for payload in drawn:
        try:
            expected += decode_payload(payload.encode(), 0, moment_of(received_us)) or ()
        except RejectedMessageError:
            continue
    assert list(rows(table)) == expected


static_payloads = st.tuples(st.sampled_from("5H"), st.lists(letters, min_size=26, max_size=72)).map(
    lambda drawn: drawn[0] + "".join(drawn[1])
)


@settings(deadline=None)
@given(
    st.lists(st.tuples(static_payloads, st.integers(0, 5)), min_size=1, max_size=20),
    st.integers(10**15, 2 * 10**15),
)
@example(
    [("5" + "0" * 70, 2), ("H" + "w" * 27, 0), ("H" + "0" * 26, 2), ("Hw000B" + "0" * 22, 0)], 1
)
def test_static_payloads_mean_what_the_reference_says(
    drawn: list[tuple[str, int]], received_us: int
) -> None:
    """Of any bits, those are usable that the reference takes, and every field is the same."""
    length_bits = np.array([6 * len(payload) - fill for payload, fill in drawn])
    bits = StaticBits([payload.encode() for payload, _ in drawn], length_bits)
    chosen = np.flatnonzero(bits.usable)
    expected: Counter[PositionReport | StaticReport] = Counter()
    for payload, fill in drawn:
        try:
            expected.update(decode_payload(payload.encode(), fill, moment_of(received_us)) or ())
        except RejectedMessageError:
            continue
    tables = bits.tables(chosen, np.full(chosen.size, received_us))
    assert Counter(chain.from_iterable(map(static_rows, tables))) == expected


@settings(deadline=None)
@given(payloads)
def test_raw_fields_are_those_of_pyais(payload: str) -> None:
    """The bits are read where pyais reads them, each field to its last unit."""
    bits = PositionBits(letters_of([payload.encode()], POSITION_LETTERS))
    if not bits.usable[0]:
        return
    (report,) = rows(bits.table(np.array([0]), np.array([10**15])))
    theirs = pyais_decode(sentence(payload))
    assert (report.mmsi, report.message_type) == (int(theirs.mmsi), theirs.msg_type)
    assert report.lat_deg == pytest.approx(theirs.lat, abs=1e-6)
    assert report.lon_deg == pytest.approx(theirs.lon, abs=1e-6)
    assert report.high_accuracy == theirs.accuracy
    for ours, told in (
        (report.sog_kn, theirs.speed),
        (report.cog_deg, theirs.course),
        (report.heading_deg, theirs.heading),
    ):
        assert ours is None or ours == told


@settings(deadline=None)
@given(
    st.lists(st.binary(max_size=60) | st.just(b"y" * (LONGEST_LINE + 9)), max_size=6),
    st.integers(1, 100) | st.integers(4000, 5000),
)
def test_blocks_hold_the_lines_of_a_text(lines: list[bytes], chunk_bytes: int) -> None:
    """Blocks are whole lines, the same as those that come one by one, endless ones cut."""
    chunks = cut(b"\n".join(lines), chunk_bytes)
    blocks = list(split_blocks(chunks))
    assert all(block.endswith(b"\n") for block in blocks[:-1])
    joined = b"".join(blocks).removesuffix(b"\n").split(b"\n") if blocks else []
    assert [line[: LONGEST_LINE + 1] for line in joined] == list(split_lines(chunks))
