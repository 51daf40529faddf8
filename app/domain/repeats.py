"""Repeats: one transmission heard by several base stations, or sent on by several networks.

Two thirds of a merged recording can be repeats. They say nothing new, yet taken as reports they
would make a vessel look as if it stood still between two of its positions.
"""

from datetime import datetime, timedelta

_REPEAT_WINDOW = timedelta(seconds=30)
_MOST_REMEMBERED = 50_000  # payloads in each of two generations, some 20 MB in all


class RepeatFilter:
    """Remembers payloads for 30 s: several base stations hear the same transmission.

    The payload holds the MMSI. Recordings merge receivers whose clocks disagree, so nothing is
    forgotten by time: of two generations of payloads the older goes when the younger is full.
    """

    def __init__(self) -> None:
        self._young: dict[bytes, datetime] = {}
        self._old: dict[bytes, datetime] = {}

    def is_repeat(self, payload: bytes, received_at: datetime) -> bool:
        """Return whether the same payload was taken within 30 s; if not, take it."""
        seen = self._young.get(payload) or self._old.get(payload)
        if seen is not None and abs(received_at - seen) <= _REPEAT_WINDOW:
            return True
        if len(self._young) >= _MOST_REMEMBERED:
            self._old, self._young = self._young, {}
        self._young[payload] = received_at
        return False
