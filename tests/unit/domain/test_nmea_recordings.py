"""Public recordings, each counted twice: by us, and by pyais or by plain search.

The expected numbers were checked by hand against `grep` counts of the files. The second counts
here are independent of our reader: lines and sentences by a regular expression on the raw file,
messages and their kinds by pyais, which reads these formats apart from their times.
"""

import gzip
import re
from collections import Counter
from pathlib import Path

import pytest
from pyais.exceptions import AISBaseException
from pyais.stream import IterMessages

from app.domain.ais import FixTimeSource, PositionReport
from app.domain.nmea import NmeaDecoder, decode_lines

_SENTENCE = re.compile(rb"!..VD[MO],")

# By file: lines, sentences, messages, positions, statics, duplicates, ignored types, rejects.
EXPECTED = {
    "dma_212123000_14h_pghp.ais": (10018, 3692, 3130, 901, 146, 2078, 5, {}),
    "dma_219165000_22min_pghp_and_suffix.ais": (249, 89, 80, 20, 4, 44, 12, {}),
    "dma_5min_2013-11-12_pghp.nmea.gz": (
        80246,
        26146,
        26077,
        24656,
        130,
        0,
        1259,
        {"mmsi_kind": 32},
    ),
    "dma_aislib_bare_aivdm.txt": (646, 646, 601, 0, 0, 0, 138, {"time": 463}),
    "dma_aislib_replay_21s_pghp.txt": (108, 51, 50, 45, 3, 0, 2, {}),
    "dma_aislib_small_mixed_tagblocks.txt": (27, 16, 11, 3, 3, 3, 2, {}),
    "dma_aislib_stream_29s_pghp.txt": (
        8551,
        4500,
        4051,
        2930,
        490,
        5,
        565,
        {"mmsi_kind": 50, "position": 11},
    ),
    "libais_tagblock_groups.nmea": (5, 5, 4, 3, 1, 0, 0, {}),
    "libais_typeexamples_uscg_suffix.nmea": (26, 26, 26, 3, 2, 0, 20, {"position": 1}),
    # Without the sentence that lacks its checksum, which pyais accepts.
    "pyais_mixed.txt": (35, 15, 12, 1, 1, 0, 0, {"mmsi_kind": 2, "time": 8}),
    "pyais_nmea_data_sample.txt": (
        898,
        898,
        878,
        0,
        0,
        0,
        14,
        {"payload_length": 100, "position": 4, "time": 760},
    ),
    "signalk_nais300_bare.log": (579, 549, 536, 0, 0, 0, 14, {"position": 130, "time": 392}),
}


def lines_of(path: Path) -> list[bytes]:
    """Return the lines of a recording, plain or gzip."""
    data = path.read_bytes()
    text = gzip.decompress(data) if path.suffix == ".gz" else data
    return text.removesuffix(b"\n").split(b"\n")


@pytest.mark.parametrize("name", EXPECTED)
def test_every_line_of_a_recording_is_accounted_for(shared_dir: Path, name: str) -> None:
    """Lines, sentences and messages of a real recording fall into the expected buckets."""
    lines = lines_of(shared_dir / "real/ais" / name)
    decoder = NmeaDecoder()
    reports = list(decode_lines(lines, decoder))
    counts, messages = decoder.accounting, decoder.accounting.messages
    found = (
        counts.lines.total,
        counts.sentences.total,
        messages.assembled,
        messages.positions,
        messages.statics,
        messages.duplicates,
        messages.ignored_type,
        {reason.value: count for reason, count in messages.rejected.items()},
    )
    assert found == EXPECTED[name]
    assert counts.balances
    assert counts.lines.total == len(lines)
    assert counts.lines.sentence == sum(bool(_SENTENCE.search(line)) for line in lines)
    assert sum(isinstance(report, PositionReport) for report in reports) == messages.positions


@pytest.mark.parametrize("name", sorted(set(EXPECTED) - {"pyais_mixed.txt"}))
def test_messages_agree_with_pyais(shared_dir: Path, name: str) -> None:
    """pyais, reading the same file its own way, finds as many messages of each kind."""
    kinds: Counter[str] = Counter()
    for sentence in IterMessages(lines_of(shared_dir / "real/ais" / name)):
        try:
            message = sentence.decode()
        except AISBaseException:
            kinds["undecodable"] += 1
            continue
        is_vessel = str(message.mmsi).zfill(9)[0] in "234567"
        if message.msg_type in (1, 2, 3, 18, 19):
            located = abs(message.lat) <= 90 and abs(message.lon) <= 180
            kinds["useful" if is_vessel and located else "useless"] += 1
        elif message.msg_type in (5, 24):
            kinds["useful" if is_vessel else "useless"] += 1
        else:
            kinds["ignored"] += 1
    decoder = NmeaDecoder()
    list(decode_lines(lines_of(shared_dir / "real/ais" / name), decoder))
    ours, rejected = decoder.accounting.messages, decoder.accounting.messages.rejected
    by_reason = Counter({reason.value: count for reason, count in rejected.items()})
    useful = ours.positions + ours.statics + ours.duplicates + by_reason["time"]
    assert useful == kinds["useful"]
    assert by_reason["position"] + by_reason["mmsi_kind"] == kinds["useless"]
    assert ours.ignored_type == kinds["ignored"]
    assert by_reason["payload_length"] == kinds["undecodable"]


def test_times_of_five_minutes_of_traffic(shared_dir: Path) -> None:
    """Nine in ten positions are dated by their own second, a quarter of a second after it."""
    lines = lines_of(shared_dir / "real/ais/dma_5min_2013-11-12_pghp.nmea.gz")
    positions = [r for r in decode_lines(lines, NmeaDecoder()) if isinstance(r, PositionReport)]
    sources = Counter(report.fix_time_source for report in positions)
    assert sources == {
        FixTimeSource.PROMPT: 22314,
        FixTimeSource.DOUBTFUL: 2106,
        FixTimeSource.RECEIVED: 236,
    }
    moments = [report.received_at for report in positions]
    assert (max(moments) - min(moments)).total_seconds() == pytest.approx(300, abs=10)
    class_a = [report for report in positions if report.ais_class == "A"]
    without_heading = sum(report.heading_deg is None for report in class_a) / len(class_a)
    assert without_heading == pytest.approx(0.13, abs=0.005)


def test_the_first_epoch_of_the_coast_guard_is_the_reception(shared_dir: Path) -> None:
    """Of two epochs after a US Coast Guard sentence the first is meant, 4 s after the fix."""
    lines = lines_of(shared_dir / "real/ais/libais_typeexamples_uscg_suffix.nmea")
    first = next(decode_lines(lines, NmeaDecoder()))
    assert first.received_at.timestamp() == 1_325_394_060
