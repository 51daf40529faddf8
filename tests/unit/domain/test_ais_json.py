"""Lines of JSON are read as AIS-catcher, gpsd and loggers of both write them."""

import json
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_json import JsonDecoder
from app.domain.rejects import Reject, RejectLog
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, with_checksum

# As printed by AIS-catcher with full decoding, and by a logger with a local clock before it.
CATCHER = (
    '{"class":"AIS","device":"AIS-catcher","version":61,"driver":1,"hardware":"RTL2838UHIDIR",'
    '"rxtime":"20250508101019","scaled":true,"channel":"B","nmea":["!AIVDM,1,1,,B,'
    '13Lh?20P00OPwK4SNhbrq?vV0<0G,0*09"],"signalpower":-15.7,"ppm":-4.6,"type":1,"repeat":0,'
    '"mmsi":231477000,"status":0,"turn":-128,"speed":0.0,"accuracy":false,"lon":-6.774024,'
    '"lat":62.006901,"course":278.800018,"heading":511,"second":19,"maneuver":0,"raim":false}'
)
LOGGED = f"2025-05-08 11:10:19,454 - {CATCHER}"
HEARD = datetime(2025, 5, 8, 10, 10, 19, tzinfo=UTC)
NOON = 1_714_564_806
TWO = json.dumps({"class": "AIS", "rxuxtime": NOON + 0.25, "nmea": encoded(VOYAGE), "type": 5})


def decode(*lines: str) -> tuple[list[PositionReport | StaticReport], JsonDecoder]:
    """Decode lines; return the reports and the decoder."""
    decoder = JsonDecoder()
    reports = list(decoder.decode(line.encode() for line in lines))
    decoder.finish()
    assert decoder.accounting.balances
    assert decoder.accounting.lines.total == len(lines)
    return reports, decoder


@pytest.mark.parametrize("line", [CATCHER, LOGGED, CATCHER.replace("!", "\\u0021"), CATCHER + ","])
def test_a_real_line_of_ais_catcher(line: str) -> None:
    """The sentence is decoded, dated by `rxtime` and not by the logger's local clock."""
    (report,), decoder = decode(line)
    assert isinstance(report, PositionReport)
    assert (report.mmsi, report.received_at, report.fix_time) == (231_477_000, HEARD, HEARD)
    assert report.lat_deg == pytest.approx(62.006901, abs=1e-5)
    assert (report.heading_deg, report.rot_deg_min) == (None, None)
    assert decoder.accounting.lines.sentence == 1


def test_a_row_is_one_line_one_sentence_and_one_message() -> None:
    """That also holds for a message of two sentences; `rxuxtime` dates it to the millisecond."""
    (report,), decoder = decode(TWO)
    assert isinstance(report, StaticReport)
    assert report.received_at == datetime(2024, 5, 1, 12, 0, 6, 250_000, tzinfo=UTC)
    counts = decoder.accounting
    assert (counts.lines.sentence, counts.sentences.total, counts.sentences.assembled) == (1, 1, 1)
    assert (counts.messages.assembled, counts.messages.statics) == (1, 1)


def test_parts_that_come_in_rows_of_their_own() -> None:
    """A receiver that sends each sentence alone loses no message."""
    rows = [json.dumps({"rxuxtime": NOON, "nmea": [part]}) for part in encoded(VOYAGE)]
    reports, decoder = decode(*reversed(rows))
    assert len(reports) == 1
    assert decoder.accounting.sentences.total == 2


def test_fields_that_a_receiver_decoded() -> None:
    """Without sentences the fields count, in gpsd's own integers too; other classes are no AIS."""
    scaled = '{"class":"AIS","rxuxtime":1714564806,"type":1,"mmsi":211000001,"lat":53.5,"lon":9.9,'
    scaled += '"speed":9.7,"course":112.3,"heading":113,"turn":"fastright"}'
    raw = '{"class":"AIS","timestamp":1714564808,"scaled":false,"type":18,"mmsi":211000001,'
    raw += '"lat":32100000,"lon":5940000,"speed":97,"course":1123,"heading":511}'
    static = '{"class":"AIS","timestamp":1714564809,"type":5,"mmsi":211000001,"shipname":"ELBE 3",'
    static += '"shiptype":70,"to_bow":8,"to_stern":11,"to_port":4,"to_starboard":3}'
    reports, decoder = decode(scaled, raw, static, '{"class":"TPV","time":"2024-05-01T12:00:06Z"}')
    first, second, third = reports
    assert isinstance(first, PositionReport)
    assert isinstance(second, PositionReport)
    assert isinstance(third, StaticReport)
    for each in (first, second):
        assert (each.lat_deg, each.lon_deg, each.sog_kn, each.cog_deg) == (53.5, 9.9, 9.7, 112.3)
    assert (first.message_type, second.message_type) == (1, 18)
    assert (third.name, third.to_bow_m) == ("ELBE 3", 8)
    assert decoder.accounting.lines.other == 1


def test_bad_rows_have_their_buckets() -> None:
    """A damaged sentence, an unknown type, no time and no position are told apart."""
    position = encoded(POSITION)[0]
    _, decoder = decode(
        json.dumps({"rxuxtime": NOON, "nmea": [position[:-1] + "?"]}),
        json.dumps({"rxuxtime": NOON, "nmea": ["!" + with_checksum("AIVDM,1,1,,A,4000,0")]}),
        json.dumps({"nmea": [position]}),
        json.dumps({"rxuxtime": NOON, "mmsi": 211_000_001, "lat": 91, "lon": 181}),
        json.dumps({"rxuxtime": NOON, "mmsi": 2_190_064, "lat": 55, "lon": 10}),
        "{not json",
        "[]",
        '{"rxuxtime": 1714564806, "nmea": ["!\\udf24"]}',
    )
    counts = decoder.accounting.as_dict()
    assert counts["lines"]["other"] == 3
    assert counts["sentences"]["rejected"] == {"checksum": 1}
    assert counts["messages"]["rejected"] == {"mmsi_kind": 1, "position": 1, "time": 1}
    assert counts["messages"]["ignored_type"] == 1


values = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
rows = st.dictionaries(
    st.sampled_from(["mmsi", "lat", "lon", "type", "rxtime", "nmea", "time", "shipname", "turn"]),
    values | st.lists(values | st.sampled_from([*encoded(POSITION), *encoded(VOYAGE)]), max_size=3),
)


@given(st.lists(rows.map(json.dumps) | st.text(max_size=40) | st.just(TWO[:-40]), max_size=15))
def test_no_line_breaks_the_reader(lines: list[str]) -> None:
    """Whatever stands in the objects, each sum is exact and as many rejects are told as counted."""
    told: list[Reject] = []
    decoder = JsonDecoder(rejects=RejectLog(told.append))
    list(decoder.decode(line.encode() for line in lines))
    decoder.finish()
    counts = decoder.accounting
    assert counts.balances
    assert counts.lines.total == len(lines)
    assert len(told) == (
        counts.sentences.rejected.total()
        + counts.sentences.orphaned
        + counts.messages.rejected.total()
    )
