"""Payload bits into reports, against pyais as the sender."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.accounting import MessageReject
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_payload import RejectedMessageError, Reports, decode_payload
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, payload_of

RECEIVED_AT = datetime(2024, 5, 1, 12, 0, 5, 300_000, tzinfo=UTC)


def decoded(fields: dict[str, object], **changes: object) -> Reports | None:
    """Encode a message with pyais and decode it with the code under test."""
    lines = encoded(fields, **changes)
    fill_bits = int(lines[-1].split(",")[6][0])
    return decode_payload("".join(map(payload_of, lines)).encode(), fill_bits, RECEIVED_AT)


@given(
    message_type=st.sampled_from([1, 2, 3, 18]),
    mmsi=st.integers(200_000_000, 799_999_999),
    lat=st.integers(-54_000_000, 54_000_000),
    lon=st.integers(-108_000_000, 108_000_000),
    speed=st.integers(0, 1022),
    course=st.integers(0, 3599),
    heading=st.integers(0, 359),
    accuracy=st.booleans(),
)
def test_positions_survive_the_air(
    message_type: int,
    mmsi: int,
    lat: int,
    lon: int,
    speed: int,
    course: int,
    heading: int,
    accuracy: bool,  # noqa: FBT001 - drawn by Hypothesis
) -> None:
    """Every field of a position report is decoded exactly, to the last unit of the message."""
    reports = decoded(
        {
            "msg_type": message_type,
            "mmsi": mmsi,
            "lat": lat / 600_000,
            "lon": lon / 600_000,
            "speed": speed / 10,
            "course": course / 10,
            "heading": heading,
            "accuracy": accuracy,
            "second": 5,
        }
    )
    assert reports is not None
    (report,) = reports
    assert isinstance(report, PositionReport)
    assert report.mmsi == mmsi
    assert report.message_type == message_type
    assert report.ais_class == ("B" if message_type == 18 else "A")
    assert report.lat_deg == pytest.approx(lat / 600_000, abs=1e-9)
    assert report.lon_deg == pytest.approx(lon / 600_000, abs=1e-9)
    assert report.sog_kn == pytest.approx(speed / 10)
    assert report.cog_deg == pytest.approx(course / 10)
    assert report.heading_deg == heading
    assert report.high_accuracy is accuracy
    assert report.fix_time == RECEIVED_AT.replace(microsecond=0)
    assert report.received_at == RECEIVED_AT


def test_voyage_data() -> None:
    """Type 5 gives names, kind and the antenna's place on the hull."""
    assert decoded(VOYAGE) == (
        StaticReport(
            211_000_001, RECEIVED_AT, "ELBE 3", "DABC", 9_074_729, 70, 8.0, 11.0, 4.0, 3.0
        ),
    )


def test_extended_class_b_gives_both_reports() -> None:
    """Type 19 gives a position and statics."""
    reports = decoded(
        {
            **POSITION,
            "msg_type": 19,
            "shipname": "JOLLE",
            "ship_type": 36,
            "to_bow": 3,
            "to_stern": 4,
            "to_port": 1,
            "to_starboard": 1,
        }
    )
    assert reports is not None
    position, static = reports
    assert isinstance(position, PositionReport)
    assert isinstance(static, StaticReport)
    assert (position.message_type, position.ais_class) == (19, "B")
    assert (static.name, static.ship_type, static.to_stern_m) == ("JOLLE", 36, 4.0)


def test_both_halves_of_class_b_statics() -> None:
    """Type 24 part A is the name, part B kind, call sign and size."""
    part_a = decoded({"msg_type": 24, "partno": 0, "mmsi": 211_000_001, "shipname": "JOLLE"})
    part_b = decoded(
        {
            "msg_type": 24,
            "partno": 1,
            "mmsi": 211_000_001,
            "ship_type": 36,
            "callsign": "DX1",
            "to_bow": 3,
            "to_stern": 4,
            "to_port": 1,
            "to_starboard": 2,
        }
    )
    empty = (None,) * 4
    assert part_a == (StaticReport(211_000_001, RECEIVED_AT, "JOLLE", None, None, None, *empty),)
    assert part_b == (
        StaticReport(211_000_001, RECEIVED_AT, None, "DX1", None, 36, 3.0, 4.0, 1.0, 2.0),
    )


def test_an_auxiliary_craft_names_its_mother_ship() -> None:
    """Under MMSI 98... the bits of the size hold the mother ship's MMSI."""
    reports = decoded(
        {"msg_type": 24, "partno": 1, "mmsi": 982_110_001, "mothership_mmsi": 211_000_001}
    )
    assert reports is not None
    (report,) = reports
    assert isinstance(report, StaticReport)
    assert report.mothership_mmsi == 211_000_001
    assert report.to_bow_m is None


@pytest.mark.parametrize("length", [1, 10, 20, 27, 29])
def test_a_position_of_another_length_is_rejected(length: int) -> None:
    """A truncated type 1 would give a wrong latitude, so no length but its own is decoded."""
    payload = (payload_of(encoded(POSITION)[0]) + "00")[:length].encode()
    with pytest.raises(RejectedMessageError) as rejected:
        decode_payload(payload, 0, RECEIVED_AT)
    assert rejected.value.reason is MessageReject.PAYLOAD_LENGTH


@pytest.mark.parametrize(
    ("payload", "fill_bits"),
    [(b"", 0), (b"5" + b"0" * 68, 0), (b"C" + b"0" * 50, 0), (b"H" + b"0" * 25, 0)],
)
def test_truncated_messages_are_rejected(payload: bytes, fill_bits: int) -> None:
    """Types 5, 19 and 24 are rejected when bits are missing, and so is nothing at all."""
    with pytest.raises(RejectedMessageError) as rejected:
        decode_payload(payload, fill_bits, RECEIVED_AT)
    assert rejected.value.reason is MessageReject.PAYLOAD_LENGTH


def test_a_part_b_without_its_last_bits_is_rejected() -> None:
    """160 bits hold a whole part A, but cut the width out of a part B."""
    payload = payload_of(encoded({"msg_type": 24, "partno": 1, "mmsi": 211_000_001})[0])
    with pytest.raises(RejectedMessageError) as rejected:
        decode_payload(payload[:27].encode(), 2, RECEIVED_AT)
    assert rejected.value.reason is MessageReject.PAYLOAD_LENGTH


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"lat": 91.0, "lon": 181.0}, MessageReject.POSITION),
        ({"lat": 91.0}, MessageReject.POSITION),
        ({"lon": 181.0}, MessageReject.POSITION),
        ({"mmsi": 2_190_067}, MessageReject.MMSI_KIND),
        ({"mmsi": 992_190_917}, MessageReject.MMSI_KIND),
    ],
)
def test_unusable_positions_are_rejected(changes: dict[str, object], reason: MessageReject) -> None:
    """An unavailable position and a sender that is no vessel are rejected by their reason."""
    with pytest.raises(RejectedMessageError) as rejected:
        decoded(POSITION, **changes)
    assert rejected.value.reason is reason


def test_a_message_without_any_time_is_rejected() -> None:
    """Nobody can place a report that nobody can date."""
    with pytest.raises(RejectedMessageError) as rejected:
        decode_payload(payload_of(encoded(POSITION)[0]).encode(), 0, None)
    assert rejected.value.reason is MessageReject.TIME


@pytest.mark.parametrize("first", "04678:;<=>?@ADEFGIJKw")
def test_other_types_are_ignored(first: str) -> None:
    """Base stations, buoys, long-range reports and the rest are no vessel reports of ours."""
    assert decode_payload((first + "0" * 27).encode(), 0, RECEIVED_AT) is None
