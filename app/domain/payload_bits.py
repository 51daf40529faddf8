"""Bits of many payloads at once: the armoured letters of thousands of messages as one array.

A field of an AIS message lies at fixed bits, the same in every message of its type. With the
letters of all messages as rows of one array, a few shifts of whole columns read a field of all.

Source: ITU-R M.1371-5, Annex 8 (table 47); bit offsets count from 0.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from app.domain import ais

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Letters = npt.NDArray[np.uint8]

_SIX_BITS = np.zeros(256, dtype=np.int64)
_SIX_BITS[48:88], _SIX_BITS[96:120] = np.arange(40), np.arange(40, 64)
_TEXT = np.frombuffer(bytes([*range(64, 96), *range(32, 64)]), dtype=np.uint8)


def letters_of(payloads: Sequence[bytes], count: int) -> Letters:
    """Return so many letters of each payload, (payloads, letters); a shorter one ends in zeros."""
    text = b"".join([payload[:count].ljust(count, b"0") for payload in payloads])
    return np.frombuffer(text, dtype=np.uint8).reshape(-1, count)


class PayloadBits:
    """The bits of many payloads, all of the same number of armoured letters."""

    def __init__(self, letters: Letters) -> None:
        """Take (payloads, letters) letters."""
        self._letters = _SIX_BITS[letters.T]

    @property
    def message_type(self) -> IntArray:
        """The type of each message."""
        return self.unsigned(0, 6)

    @property
    def mmsi(self) -> IntArray:
        """The MMSI of each message."""
        return self.unsigned(8, 30)

    def unsigned(self, start: int, width: int) -> IntArray:
        """Return the number that stands in some bits of each payload."""
        first, end = start // 6, -(-(start + width) // 6)
        value: IntArray = self._letters[first]
        for at in range(first + 1, end):
            value = value << 6 | self._letters[at]
        return value >> (6 * end - start - width) & ((1 << width) - 1)

    def text(self, start: int, width: int) -> list[str | None]:
        """Return the six-bit text that stands in some bits of each payload."""
        letters = width // 6
        codes = [self.unsigned(start + 6 * at, 6) for at in range(letters)]
        raw = _TEXT[np.stack(codes, axis=1)].tobytes().decode("ascii")
        return [ais.clean_text(raw[at : at + letters]) for at in range(0, len(raw), letters)]


def are_vessels(mmsi: IntArray) -> BoolArray:
    """Return which MMSI are those of vessels: `ais.is_vessel_mmsi` by column."""
    return are_within(mmsi, ais.SHIP_MMSI) | are_within(mmsi, ais.AUXILIARY_MMSI)


def are_within(values: IntArray, bounds: range) -> BoolArray:
    """Return which values lie in a range."""
    inside: BoolArray = (values >= bounds.start) & (values < bounds.stop)
    return inside
