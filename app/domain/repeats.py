"""Repeats: one transmission heard by several base stations, or sent on by several networks.

Two thirds of a merged recording can be repeats. They say nothing new, yet taken as reports they
would make a vessel look as if it stood still between two of its positions.
"""

from collections.abc import Sequence
from datetime import datetime

from app.domain.nmea_times import epoch_us

_REPEAT_WINDOW_US = 30_000_000
_MOST_REMEMBERED = 50_000  # payloads in each of two generations, some 20 MB in all


class RepeatFilter:
    """Remembers payloads for 30 s: several base stations hear the same transmission.

    The payload holds the MMSI. Recordings merge receivers whose clocks disagree, so nothing is
    forgotten by time: of two generations of payloads the older goes when the younger is full.
    """

    def __init__(self) -> None:
        self._young: dict[bytes, int] = {}  # when each was taken, us since 1970
        self._old: dict[bytes, int] = {}

    def is_repeat(self, payload: bytes, received_at: datetime) -> bool:
        """Return whether the same payload was taken within 30 s; if not, take it."""
        return not self.first_heard((payload,), (epoch_us(received_at),))[0]

    def first_heard(self, payloads: Sequence[bytes], received_us: Sequence[int]) -> list[bool]:
        """Return which payloads are no repeats, one after another; these are taken."""
        new = dict(zip(payloads, received_us, strict=True))
        fits = len(self._young) + len(new) <= _MOST_REMEMBERED
        if len(new) == len(payloads) and fits and self._knows_none(payloads):
            self._young |= new
            return [True] * len(payloads)
        return self._one_after_another(payloads, received_us)

    def _knows_none(self, payloads: Sequence[bytes]) -> bool:
        """Whether all are new, as most blocks of a single receiver's recording are."""
        return self._young.keys().isdisjoint(payloads) and self._old.keys().isdisjoint(payloads)

    def _one_after_another(
        self, payloads: Sequence[bytes], received_us: Sequence[int]
    ) -> list[bool]:
        first = []
        for payload, at_us in zip(payloads, received_us, strict=True):
            taken_us = self._young.get(payload) or self._old.get(payload)
            if taken_us is not None and abs(at_us - taken_us) <= _REPEAT_WINDOW_US:
                first.append(False)
                continue
            if len(self._young) >= _MOST_REMEMBERED:
                self._old, self._young = self._young, {}
            self._young[payload] = at_us
            first.append(True)
        return first
