"""Training, validation and test parts without leakage, the same whenever the same is asked for.

What must stay together is a unit: a calendar day of all cameras, or a vessel with its convoy. A
convoy is whoever was seen within reach of each other on the same photograph, and so on: a tug and
its tow, a pushed barge, vessels moored side by side. A unit's part is drawn from a hash of its name
and the seed, so a unit keeps its part when others come along; only where new photographs join two
convoys one of them may move.

By vessel a photograph may be in more than one part, each time with the vessels of that part alone.
"""

import hashlib
from collections.abc import Iterable, Sequence
from math import cos, radians, sin
from typing import NamedTuple

PARTS = ("train", "val", "test")
REACH_M = 20.0
M_PER_DEGREE = 111_320.0


class Afloat(NamedTuple):
    """Where a vessel's box lies on the water."""

    mmsi: int
    lat_deg: float
    lon_deg: float
    heading_deg: float
    length_m: float
    width_m: float


def drawn_part(unit: str, seed: int, fractions: Sequence[float]) -> str:
    """Return the part of a unit; `fractions` are those of `PARTS` and add up to 1."""
    digest = hashlib.sha256(f"{seed}:{unit}".encode()).digest()
    draw = int.from_bytes(digest[:8]) / 2**64
    for part, fraction in zip(PARTS, fractions, strict=True):
        draw -= fraction
        if draw < 0:
            return part
    return next(p for p, f in reversed(list(zip(PARTS, fractions, strict=True))) if f > 0)


class Convoys:
    """Which vessels must stay together; photographs are added one by one."""

    def __init__(self) -> None:
        self._leader: dict[int, int] = {}

    def add_photograph(self, vessels: Iterable[Afloat]) -> None:
        """Bind those vessels of a photograph that are within reach of each other."""
        met: list[Afloat] = []
        for vessel in vessels:
            self._leader.setdefault(vessel.mmsi, vessel.mmsi)
            for other in met:
                if other.mmsi != vessel.mmsi and gap_m(vessel, other) <= REACH_M:
                    self.bind(vessel.mmsi, other.mmsi)
            met.append(vessel)

    def bind(self, one: int, other: int) -> None:
        """Keep two vessels together."""
        first, second = sorted((self.leader(one), self.leader(other)))
        self._leader[second] = first

    def leader(self, mmsi: int) -> int:
        """Return the vessel that stands for a vessel's convoy: its smallest MMSI."""
        found = self._leader.setdefault(mmsi, mmsi)
        while found != self._leader[found]:
            found = self._leader[found]
        self._leader[mmsi] = found
        return found

    def parts(self, seed: int, fractions: Sequence[float]) -> dict[int, str]:
        """Return the part of every vessel that was added."""
        return {
            mmsi: drawn_part(f"vessel {self.leader(mmsi)}", seed, fractions)
            for mmsi in sorted(self._leader)
        }


def gap_m(one: Afloat, other: Afloat) -> float:
    """Return how far apart two boxes on the water are at least; negative where they overlap.

    It is the widest gap seen along a side of either (separating axes), on a plane: they are near.
    """
    north = (other.lat_deg - one.lat_deg) * M_PER_DEGREE
    east = (other.lon_deg - one.lon_deg) * M_PER_DEGREE * cos(radians(one.lat_deg))
    gaps = []
    for along_deg in (one.heading_deg, other.heading_deg):
        for axis_deg in (along_deg, along_deg + 90):
            axis = radians(axis_deg)
            apart = abs(east * sin(axis) + north * cos(axis))
            gaps.append(apart - _reach(one, axis_deg) - _reach(other, axis_deg))
    return max(gaps)


def _reach(vessel: Afloat, axis_deg: float) -> float:
    """Return how far a box reaches from its middle along an axis, m."""
    turn = radians(axis_deg - vessel.heading_deg)
    return (abs(cos(turn)) * vessel.length_m + abs(sin(turn)) * vessel.width_m) / 2
