"""Static payloads by the thousand: the fields of messages 5 and 24, read as columns.

What `ais_bulk` is for positions, but there are far fewer of them: so the columns end as reports,
one by one. Only what is usable becomes a report; the rest (cut short, not a vessel, a third part of
message 24) is for `ais_payload`, which knows its bucket.

Source: ITU-R M.1371-5, Annex 8 (tables 52, 79, 80); bit offsets count from 0.
"""

from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime

import numpy as np

from app.domain import ais
from app.domain.ais import StaticReport
from app.domain.nmea_times import moment_of
from app.domain.payload_bits import (
    BoolArray,
    IntArray,
    PayloadBits,
    are_vessels,
    are_within,
    letters_of,
)

STATIC_TYPES = b"5H"  # as their armoured first letter has them
_LETTERS_READ = 46  # all fields end before bit 276

_Size = tuple[float | None, float | None, float | None, float | None]  # A, B, C, D
_NO_SIZE: _Size = (None, None, None, None)


class StaticBits:
    """Many static payloads; `usable` tells which are a vessel's and whole."""

    def __init__(self, payloads: Sequence[bytes], length_bits: IntArray) -> None:
        """Take payloads that begin with one of `STATIC_TYPES`, and their lengths without fill."""
        self._payloads = payloads
        bits = PayloadBits(letters_of(payloads, _LETTERS_READ))
        part = bits.unsigned(38, 2)
        is_of = ((bits.message_type == 5), (part == 0), (part == 1))
        longest = (range(420, 427), range(160, 169), range(168, 169))
        lengths = [are_within(length_bits, bounds) for bounds in longest]
        self._kind = np.select(is_of, range(len(_READERS)), -1)
        self.usable: BoolArray = np.select(is_of, lengths, default=False) & are_vessels(bits.mmsi)

    def reports(self, chosen: IntArray, received_us: IntArray) -> Iterator[StaticReport]:
        """Yield the chosen payloads' reports; `received_us` belongs to the chosen."""
        for kind, read in enumerate(_READERS):
            at = np.flatnonzero(self._kind[chosen] == kind)
            if at.size:
                payloads = [self._payloads[i] for i in chosen[at].tolist()]
                bits = PayloadBits(letters_of(payloads, _LETTERS_READ))
                yield from read(bits, map(moment_of, received_us[at].tolist()))


def _voyages(bits: PayloadBits, received_at: Iterable[datetime]) -> Iterator[StaticReport]:
    """Type 5."""
    columns = (bits.text(112, 120), bits.text(70, 42), _known(bits, 40, 30), _known(bits, 232, 8))
    for mmsi, moment, size, *rest in zip(
        bits.mmsi.tolist(), received_at, _sizes(bits, 240), *columns, strict=True
    ):
        yield StaticReport(mmsi, moment, *rest, *size)


def _names(bits: PayloadBits, received_at: Iterable[datetime]) -> Iterator[StaticReport]:
    """Type 24, part A."""
    columns = bits.mmsi.tolist(), received_at, bits.text(40, 120)
    for mmsi, moment, name in zip(*columns, strict=True):
        yield StaticReport(mmsi, moment, name, None, None, None, *_NO_SIZE)


def _others(bits: PayloadBits, received_at: Iterable[datetime]) -> Iterator[StaticReport]:
    """Type 24, part B: an auxiliary craft's has its mother ship in place of the size."""
    columns = (bits.text(90, 42), _known(bits, 40, 8), _sizes(bits, 132), _known(bits, 132, 30))
    for mmsi, moment, callsign, ship_type, size, mothership in zip(
        bits.mmsi.tolist(), received_at, *columns, strict=True
    ):
        if mmsi in ais.AUXILIARY_MMSI:
            yield StaticReport(mmsi, moment, None, callsign, None, ship_type, *_NO_SIZE, mothership)
        else:
            yield StaticReport(mmsi, moment, None, callsign, None, ship_type, *size)


def _known(bits: PayloadBits, start: int, width: int) -> list[int | None]:
    return [ais.positive_or_none(raw) for raw in bits.unsigned(start, width).tolist()]


def _sizes(bits: PayloadBits, start: int) -> list[_Size]:
    widths = ((0, 9), (9, 9), (18, 6), (24, 6))
    columns = (bits.unsigned(start + offset, width).tolist() for offset, width in widths)
    return [ais.antenna_distances_m(*size) for size in zip(*columns, strict=True)]


_READERS = (_voyages, _names, _others)
