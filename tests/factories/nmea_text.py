"""Sentences for tests: the sender's side of NMEA, written apart from the reader under test."""

from functools import reduce
from operator import xor

from pyais.encode import encode_dict

POSITION: dict[str, object] = {
    "msg_type": 1,
    "mmsi": 211_000_001,
    "status": 0,
    "speed": 9.7,
    "accuracy": 1,
    "lon": 9.980115,
    "lat": 53.53972,
    "course": 112.3,
    "heading": 113,
    "second": 5,
}
VOYAGE: dict[str, object] = {
    "msg_type": 5,
    "mmsi": 211_000_001,
    "imo": 9_074_729,
    "callsign": "DABC",
    "shipname": "ELBE 3",
    "ship_type": 70,
    "to_bow": 8,
    "to_stern": 11,
    "to_port": 4,
    "to_starboard": 3,
}


def with_checksum(body: str) -> str:
    """Return the body between start character and checksum with its `*hh`."""
    return f"{body}*{reduce(xor, body.encode(), 0):02X}"


def sentence(
    payload: str, part: str = "1,1,", channel: str = "A", fill: int = 0, tag: str = "AIVDM"
) -> str:
    """Return a sentence; `part` is count, number and sequence: `2,1,3`."""
    return "!" + with_checksum(f"{tag},{part},{channel},{payload},{fill}")


def tag_block(content: str) -> str:
    """Return a tag block with its checksum and backslashes."""
    return f"\\{with_checksum(content)}\\"


def pghp(time: str = "2024,5,1,12,0,6,250", station: str = "219,,2190067") -> str:
    """Return a `$PGHP` line."""
    return "$" + with_checksum(f"PGHP,1,{time},{station},1,00")


def encoded(fields: dict[str, object], **changes: object) -> list[str]:
    """Return a message encoded by pyais, one sentence or several."""
    return [str(line) for line in encode_dict({**fields, **changes}, radio_channel="A")]


def payload_of(line: str) -> str:
    """Return the payload field of a sentence."""
    return line.split(",")[5]
