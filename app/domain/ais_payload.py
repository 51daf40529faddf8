"""Payload bits into reports, for the seven message types that tell of a vessel's place and shape.

pyais undoes the six-bit armour; the fields are then read one by one where ITU-R M.1371 puts them,
because a fusion run needs ten of them and building whole message objects costs most of the time.
The length of a payload is enforced before anything is read: a truncated type 1 otherwise yields a
plausible, wrong latitude.

Source: ITU-R M.1371-5, Annex 8 (tables 48, 52, 70, 71, 79, 80); bit offsets count from 0.
"""

from base64 import b64encode
from collections.abc import Callable
from datetime import datetime
from string import ascii_lowercase, ascii_uppercase, digits

from pyais.bit_vector import int_bit_vector

from app.domain import ais
from app.domain.accounting import MessageReject

# From base64 to the six-bit letters of table 47: `@A..Z[\\]^_ !..?`.
_SIX_BIT_LETTERS = bytes.maketrans(
    (ascii_uppercase + ascii_lowercase + digits + "+/").encode(),
    bytes([*range(64, 96), *range(32, 64)]),
)

Reports = tuple[ais.PositionReport | ais.StaticReport, ...]


class RejectedMessageError(ValueError):
    """A message of a wanted type that cannot be used; `reason` is its bucket."""

    def __init__(self, reason: MessageReject) -> None:
        super().__init__(reason.value)
        self.reason = reason


def decode_payload(payload: bytes, fill_bits: int, received_at: datetime | None) -> Reports | None:
    """Decode an assembled payload into one report, or two for type 19; None for other types.

    Raises:
        RejectedMessageError: wrong length, not a vessel, no position, or no time of reception.

    """
    if not payload:
        raise RejectedMessageError(MessageReject.PAYLOAD_LENGTH)
    wanted = _WANTED.get(payload[0])
    if wanted is None:
        return None
    shortest, longest, read = wanted
    if not shortest <= 6 * len(payload) - fill_bits <= longest:
        raise RejectedMessageError(MessageReject.PAYLOAD_LENGTH)
    bits = int_bit_vector(payload, fill_bits)
    mmsi = bits.get(8, 30)
    if not ais.is_vessel_mmsi(mmsi):
        raise RejectedMessageError(MessageReject.MMSI_KIND)
    return read(bits, mmsi, received_at)


def _class_a(bits: int_bit_vector, mmsi: int, received_at: datetime | None) -> Reports:
    """Types 1, 2, 3: the class B fields shifted by four bits, and a rate of turn."""
    rate = ais.rate_of_turn_deg_min(bits.get_signed(42, 8))
    return (
        _position(bits, mmsi, received_at, offset=50, rate_of_turn_deg_min=rate, ais_class="A"),
    )


def _class_b(bits: int_bit_vector, mmsi: int, received_at: datetime | None) -> Reports:
    """Type 18."""
    return (_position(bits, mmsi, received_at, offset=46, ais_class="B"),)


def _class_b_extended(bits: int_bit_vector, mmsi: int, received_at: datetime | None) -> Reports:
    """Type 19: a position with name, ship type and dimensions."""
    position = _position(bits, mmsi, received_at, offset=46, ais_class="B")
    static = _static(
        bits,
        mmsi,
        position.received_at,
        name=_text(bits, 143, 120),
        ship_type=bits.get(263, 8),
        size_at=271,
    )
    return (position, static)


def _voyage(bits: int_bit_vector, mmsi: int, received_at: datetime | None) -> Reports:
    """Type 5."""
    return (
        _static(
            bits,
            mmsi,
            _known(received_at),
            imo=bits.get(40, 30),
            callsign=_text(bits, 70, 42),
            name=_text(bits, 112, 120),
            ship_type=bits.get(232, 8),
            size_at=240,
        ),
    )


def _static_parts(bits: int_bit_vector, mmsi: int, received_at: datetime | None) -> Reports | None:
    """Type 24: part A is a name; part B the rest, or an auxiliary craft's mother ship."""
    part = bits.get(38, 2)
    if part == 0:
        return (_static(bits, mmsi, _known(received_at), name=_text(bits, 40, 120)),)
    if part != 1:
        return None
    if len(bits) < 168:
        raise RejectedMessageError(MessageReject.PAYLOAD_LENGTH)
    is_auxiliary = mmsi // 10_000_000 == 98
    return (
        _static(
            bits,
            mmsi,
            _known(received_at),
            ship_type=bits.get(40, 8),
            callsign=_text(bits, 90, 42),
            size_at=None if is_auxiliary else 132,
            mothership_mmsi=bits.get(132, 30) if is_auxiliary else 0,
        ),
    )


def _position(
    bits: int_bit_vector,
    mmsi: int,
    received_at: datetime | None,
    *,
    offset: int,
    rate_of_turn_deg_min: float | None = None,
    ais_class: ais.AisClass,
) -> ais.PositionReport:
    """Read the 93 bits from speed to UTC second that start at bit `offset`, all at once."""
    run = bits.get(offset, 93)
    lon_deg = ais.longitude_deg(_signed(run >> 54, 28))
    lat_deg = ais.latitude_deg(_signed(run >> 27, 27))
    if lon_deg is None or lat_deg is None:
        raise RejectedMessageError(MessageReject.POSITION)
    received_at = _known(received_at)
    moment, source = ais.fix_time(received_at, run & 0x3F)
    return ais.PositionReport(
        mmsi,
        moment,
        received_at,
        lat_deg,
        lon_deg,
        ais.speed_kn(run >> 83),
        ais.course_deg((run >> 15) & 0xFFF),
        ais.heading_deg((run >> 6) & 0x1FF),
        rate_of_turn_deg_min,
        bits.get(0, 6),
        ais_class,
        bool((run >> 82) & 1),
        source,
    )


def _signed(value: int, width: int) -> int:
    """Return the lowest `width` bits as a two's complement number."""
    sign = 1 << (width - 1)
    return ((value & (2 * sign - 1)) ^ sign) - sign


def _text(bits: int_bit_vector, start: int, width: int) -> str:
    """Read six-bit text through base64, whose letters have six bits too: faster than a loop."""
    spare = -width % 24
    run = bits.get(start, width) << spare
    letters = b64encode(run.to_bytes((width + spare) // 8)).translate(_SIX_BIT_LETTERS)
    return letters[: width // 6].decode("ascii")


def _static(
    bits: int_bit_vector,
    mmsi: int,
    received_at: datetime,
    *,
    name: str = "",
    callsign: str = "",
    imo: int = 0,
    ship_type: int = 0,
    size_at: int | None = None,
    mothership_mmsi: int = 0,
) -> ais.StaticReport:
    size = (0, 0, 0, 0)
    if size_at is not None:
        size = (
            bits.get(size_at, 9),
            bits.get(size_at + 9, 9),
            bits.get(size_at + 18, 6),
            bits.get(size_at + 24, 6),
        )
    return ais.StaticReport(
        mmsi,
        received_at,
        ais.clean_text(name),
        ais.clean_text(callsign),
        ais.positive_or_none(imo),
        ais.positive_or_none(ship_type),
        *ais.antenna_distances_m(*size),
        ais.positive_or_none(mothership_mmsi),
    )


def _known(received_at: datetime | None) -> datetime:
    if received_at is None:
        raise RejectedMessageError(MessageReject.TIME)
    return received_at


_Reader = Callable[[int_bit_vector, int, datetime | None], Reports | None]

# By the armoured first character, which alone holds the type: shortest and longest payload in
# bits, and the reader. Types 5 and 24 are sent with and without their spare bits.
_WANTED: dict[int, tuple[int, int, _Reader]] = {
    ord("1"): (168, 168, _class_a),
    ord("2"): (168, 168, _class_a),
    ord("3"): (168, 168, _class_a),
    ord("5"): (420, 426, _voyage),
    ord("B"): (168, 168, _class_b),
    ord("C"): (312, 312, _class_b_extended),
    ord("H"): (160, 168, _static_parts),
}

WANTED_LETTERS = bytes(_WANTED)  # all other messages are of an ignored type
