"""Vessels of the harbour: a ship, its papers, its transponder and its passage."""

from dataclasses import dataclass
from typing import Literal

from app.simulation.motion import Passage
from app.simulation.ships import Ship


@dataclass(frozen=True, slots=True)
class Transponder:
    """An AIS unit and what was entered into it.

    The antenna's true place in the hull and the four distances it reports may differ. `heading` is
    False for a unit without a compass; `silence_s` is a span of time in which it is not heard.
    """

    ais_class: Literal["A", "B"]
    mmsi: int
    antenna_ahead_m: float  # of the hull's middle
    antenna_port_m: float
    to_bow_m: int
    to_stern_m: int
    to_port_m: int
    to_starboard_m: int
    heading: bool
    compass_error_deg: float
    silence_s: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Vessel:
    """One vessel during one session."""

    identifier: str
    name: str
    callsign: str
    imo: int
    ship: Ship
    transponder: Transponder | None
    passage: Passage
    moored: bool

    @property
    def mmsi(self) -> int | None:
        """Its MMSI, when it carries AIS."""
        return self.transponder.mmsi if self.transponder else None
