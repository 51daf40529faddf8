"""Static payloads by the thousand: the fields of messages 5 and 24, read as columns.

What `ais_bulk` is for positions. Only what is usable becomes a row; the rest (cut short, not a
vessel, a third part of message 24) is for `ais_payload`, which knows its bucket.

Source: ITU-R M.1371-5, Annex 8 (tables 52, 79, 80); bit offsets count from 0.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from app.domain import ais
from app.domain.arrays import FloatArray
from app.domain.payload_bits import (
    BoolArray,
    IntArray,
    PayloadBits,
    are_vessels,
    are_within,
    letters_of,
)
from app.domain.static_table import ObjectArray, StaticTable

STATIC_TYPES = b"5H"  # as their armoured first letter has them
_LETTERS_READ = 46  # all fields end before bit 276
_SIZES = ("to_bow_m", "to_stern_m", "to_port_m", "to_starboard_m")  # A, B, C, D


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

    def tables(self, chosen: IntArray, received_us: IntArray) -> Iterator[StaticTable]:
        """Yield the chosen payloads' reports; `received_us` belongs to the chosen."""
        for kind, read in enumerate(_READERS):
            at = np.flatnonzero(self._kind[chosen] == kind)
            if at.size:
                payloads = [self._payloads[i] for i in chosen[at].tolist()]
                bits = PayloadBits(letters_of(payloads, _LETTERS_READ))
                yield StaticTable.saying(bits.mmsi, received_us[at], **read(bits))


def _voyages(bits: PayloadBits) -> dict[str, Any]:
    """Type 5."""
    return {
        "name": bits.text(112, 120),
        "callsign": bits.text(70, 42),
        "imo": _known(bits, 40, 30),
        "ship_type": _known(bits, 232, 8),
        **_sizes(bits, 240),
    }


def _names(bits: PayloadBits) -> dict[str, Any]:
    """Type 24, part A."""
    return {"name": bits.text(40, 120)}


def _others(bits: PayloadBits) -> dict[str, Any]:
    """Type 24, part B: an auxiliary craft's has its mother ship in place of the size."""
    is_auxiliary = are_within(bits.mmsi, ais.AUXILIARY_MMSI)
    sizes = _sizes(bits, 132)
    mothership_mmsi = _known(bits, 132, 30)
    mothership_mmsi[~is_auxiliary] = None
    return {
        "callsign": bits.text(90, 42),
        "ship_type": _known(bits, 40, 8),
        **{name: np.where(is_auxiliary, np.nan, size_m) for name, size_m in sizes.items()},
        "mothership_mmsi": mothership_mmsi,
    }


def _known(bits: PayloadBits, start: int, width: int) -> ObjectArray:
    """Return identifiers: `ais.positive_or_none` by column."""
    raw = bits.unsigned(start, width)
    known: ObjectArray = raw.astype(np.object_)
    known[raw == 0] = None
    return known


def _sizes(bits: PayloadBits, start: int) -> dict[str, FloatArray]:
    """Return the distances of an antenna: `ais.antenna_distances_m` by column."""
    widths = ((0, 9), (9, 9), (18, 6), (24, 6))
    raw = np.stack([bits.unsigned(start + offset, width) for offset, width in widths])
    sizes_m = np.where(raw.any(axis=0), raw, np.nan)
    return dict(zip(_SIZES, sizes_m, strict=True))


_READERS = (_voyages, _names, _others)
