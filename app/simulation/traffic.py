"""Who passes: vessels of a session, on lanes that suit their kind, never through one another.

Traffic keeps to the right. Vessels are sent so that they pass the middle of the view at seeded
moments, spread over the session; one that would come too near another is sent later.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from app.domain.arrays import FloatArray
from app.simulation.motion import Passage, Route
from app.simulation.scenery import LEFT_BANK, RIGHT_BANK
from app.simulation.settings import TrafficSettings
from app.simulation.ship_plans import Fleet
from app.simulation.ships import Ship, ShipType, build_ship
from app.simulation.vessels import Transponder, Vessel

KNOT_M_S = 1852 / 3600

_FIRST = ("Anke", "Berta", "Clara", "Dora", "Elbe", "Frieda", "Greta", "Hanna", "Ida", "Jette",
          "Karla", "Lotte", "Meta", "Nele", "Olga", "Paula", "Quitte", "Rieke", "Stine", "Tilda",
          "Undine", "Vera", "Wiebke", "Xenia", "Yvonne", "Zora")  # fmt: skip
_SECOND = ("", " II", " III", "-Marie", " von Ort", " Star", " Maru", "-Luise", " Nord", " Express")


@dataclass(frozen=True, slots=True)
class _Habit:
    """How a type sails: chance, speed in knots, nearest and farthest distance from the camera."""

    share: float
    speed_kn: tuple[float, float]
    across_m: tuple[float, float]
    basin_share: float = 0.0


_HABITS = {
    ShipType.TUG: _Habit(0.24, (6, 10), (140, 400), 0.25),
    ShipType.FERRY: _Habit(0.24, (8, 12), (120, 330), 0.1),
    ShipType.CONVOY: _Habit(0.1, (4, 6), (260, 420)),
    ShipType.CONTAINER_SHIP: _Habit(0.1, (6, 9), (300, 425)),
    ShipType.SAILING_BOAT: _Habit(0.1, (3, 6), (120, 300)),
    ShipType.LAUNCH: _Habit(0.12, (5, 9), (105, 360), 0.35),
    ShipType.INLAND_SHIP: _Habit(0.1, (5, 8), (200, 420)),
}
# Where ships lie: wall (start and end in the harbour's frame), metres along it, longest ship.
# The water is to the right of start to end.
_BERTHS = (
    (RIGHT_BANK[1], RIGHT_BANK[2], 85.0, 70.0),
    (LEFT_BANK[0], LEFT_BANK[1], 1378.0, 60.0),
    (RIGHT_BANK[0], RIGHT_BANK[1], 400.0, 110.0),
    (RIGHT_BANK[1], RIGHT_BANK[2], 190.0, 110.0),
    (LEFT_BANK[0], LEFT_BANK[1], 1290.0, 95.0),
)


def make_vessels(
    rng: np.random.Generator,
    settings: TrafficSettings,
    fleet: Fleet,
    harbour_to_enu: FloatArray,
    span_s: tuple[float, float],
    prefix: str,
    first_mmsi: int,
) -> tuple[Vessel, ...]:
    """Draw the vessels of a session that lasts over `span_s`; MMSIs count up from the first."""
    vessels: list[Vessel] = []
    for number, berth in enumerate(rng.permutation(len(_BERTHS))[: settings.moored_vessels]):
        ship, passage = _moored(rng, fleet, harbour_to_enu, _BERTHS[int(berth)])
        unit = _transponder(rng, settings, ship, first_mmsi + len(vessels), span_s)
        with_ais = rng.random() < settings.moored_with_ais_share
        name = f"{prefix}-moored-{number}"
        vessels.append(_manned(rng, ship, passage, name, unit if with_ais else None))
    moment = span_s[0] - 30.0
    number = 0
    while moment < span_s[1] + 30.0:
        for _ in range(8):
            ship_type = _drawn_type(rng)
            ship = build_ship(ship_type, rng, fleet)
            passage = _passing(rng, settings, ship_type, harbour_to_enu, moment)
            if _clear(ship, passage, vessels, span_s):
                unit = _transponder(rng, settings, ship, first_mmsi + len(vessels), span_s)
                with_ais = rng.random() >= settings.no_ais_share
                name = f"{prefix}-{number:02d}"
                vessels.append(_manned(rng, ship, passage, name, unit if with_ais else None))
                number += 1
                break
        moment += float(rng.uniform(0.5, 1.5)) * settings.spacing_s
    return tuple(vessels)


def _drawn_type(rng: np.random.Generator) -> ShipType:
    types = list(_HABITS)
    shares = np.array([_HABITS[t].share for t in types])
    return types[int(rng.choice(len(types), p=shares / shares.sum()))]


def _passing(
    rng: np.random.Generator,
    settings: TrafficSettings,
    ship_type: ShipType,
    harbour_to_enu: FloatArray,
    moment_s: float,
) -> Passage:
    """Draw a passage whose vessel is opposite the camera at `moment_s`."""
    habit = _HABITS[ship_type]
    speed = float(rng.uniform(*habit.speed_kn)) * KNOT_M_S * settings.speed_factor
    across = float(rng.uniform(*habit.across_m))
    # Keep to the right: those going right (as seen) take the near half of their range.
    rightwards = across < sum(habit.across_m) / 2
    slant = float(rng.normal(0.0, 0.035))
    if rng.random() < habit.basin_share:
        corners = [(-2600.0, 300.0), (-60.0, 330.0), (28.0, 480.0), (-46.0, 1040.0)]
        corners = [(x + float(rng.uniform(-6, 6)), y) for x, y in corners]
        if rightwards:
            corners = corners[::-1]
        rounding = 90.0
    else:
        bend = float(rng.normal(0.0, 14.0))
        corners = [(-4000.0, across - 4000 * slant), (-500.0, across - 500 * slant),
                   (0.0, across + bend), (500.0, across + 500 * slant),
                   (4000.0, across + 4000 * slant)]  # fmt: skip
        corners = [(x, float(np.clip(y, 85.0, 440.0))) for x, y in corners]
        if not rightwards:
            corners = corners[::-1]
        rounding = 420.0
    plan = np.column_stack([np.array(corners), np.zeros(len(corners))])
    route = Route.through((plan @ harbour_to_enu.T)[:, :2], rounding)
    middle_m = _opposite(route, harbour_to_enu)
    drift = float(rng.normal(0.0, 1.0)) * settings.drift_sigma_deg
    return Passage(route, speed, moment_s, middle_m, drift)


def _opposite(route: Route, harbour_to_enu: FloatArray) -> float:
    """How far along its route a vessel is nearest to the line of view."""
    right = route.points_m @ harbour_to_enu[:2, 0]
    return float(np.argmin(np.abs(right))) * route.length_m / (len(route.points_m) - 1)


def _moored(
    rng: np.random.Generator,
    fleet: Fleet,
    harbour_to_enu: FloatArray,
    berth: tuple[tuple[float, float], tuple[float, float], float, float],
) -> tuple[Ship, Passage]:
    """Put a ship alongside, a fender's width from the wall."""
    kinds = (ShipType.TUG, ShipType.INLAND_SHIP, ShipType.FERRY, ShipType.LAUNCH)
    start, end, along_m, longest_m = berth
    ship = build_ship(kinds[int(rng.integers(len(kinds)))], rng, fleet)
    if ship.length_m > longest_m:
        ship = build_ship(ShipType.TUG, rng, fleet)
    direction = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
    off_wall = np.array([direction[1], -direction[0]]) * (ship.width_m / 2 + 1.2)
    place = np.array(start) + direction * (along_m + float(rng.uniform(-15, 15))) + off_wall
    if rng.random() < 0.5:
        direction = -direction
    line = np.array([place - 5 * direction, place + 5 * direction])
    plan = np.column_stack([line, np.zeros(2)])
    route = Route.through((plan @ harbour_to_enu.T)[:, :2], 2.0)
    return ship, Passage(route, 0.0, 0.0, 5.0, 0.0)


def _clear(
    ship: Ship, passage: Passage, others: Sequence[Vessel], span_s: tuple[float, float]
) -> bool:
    """Whether a vessel keeps its distance from all others while the session lasts."""
    times = np.arange(span_s[0], span_s[1] + 1, 6.0)
    mine = np.array([(m.east_m, m.north_m, m.heading_deg) for m in map(passage.at, times)])
    axis = np.column_stack([np.sin(np.radians(mine[:, 2])), np.cos(np.radians(mine[:, 2]))])
    for other in others:
        theirs = np.array([(m.east_m, m.north_m) for m in map(other.passage.at, times)])
        gap = theirs - mine[:, :2]
        along = np.abs((gap * axis).sum(axis=1))
        aside = np.abs(gap[:, 0] * axis[:, 1] - gap[:, 1] * axis[:, 0])
        long_m = (ship.length_m + other.ship.length_m) / 2 + 25
        wide_m = (ship.width_m + other.ship.width_m) / 2 + 14
        if ((along < long_m) & (aside < wide_m)).any():
            return False
    return True


def _manned(
    rng: np.random.Generator,
    ship: Ship,
    passage: Passage,
    identifier: str,
    transponder: Transponder | None,
) -> Vessel:
    """Give a ship its papers."""
    name = _FIRST[int(rng.integers(len(_FIRST)))] + _SECOND[int(rng.integers(len(_SECOND)))]
    letters = "".join(chr(65 + int(c)) for c in rng.integers(0, 26, 2))
    callsign = f"D{letters}{rng.integers(10, 99)}"
    imo = int(rng.integers(9100000, 9899999))
    moored = passage.speed_m_s == 0
    return Vessel(identifier, name.upper(), callsign, imo, ship, transponder, passage, moored)


def _transponder(
    rng: np.random.Generator,
    settings: TrafficSettings,
    ship: Ship,
    mmsi: int,
    span_s: tuple[float, float],
) -> Transponder:
    """Fit a transponder, with what people get wrong when they set it up."""
    small = ship.ship_type in {ShipType.SAILING_BOAT, ShipType.LAUNCH}
    class_b = small and rng.random() < settings.class_b_share
    lacking = (
        settings.class_b_without_heading_share
        if class_b
        else settings.class_a_without_heading_share
    )
    to_stern = float(round(ship.length_m * rng.uniform(0.15, 0.7)))
    to_starboard = float(round(ship.width_m * rng.uniform(0.35, 0.65)))
    true = np.array([ship.length_m - to_stern, to_stern, ship.width_m - to_starboard, to_starboard])
    entered = true + rng.normal(0.0, 1.0, 4) * settings.dimension_sigma_m
    if rng.random() < settings.wrong_dimensions_share:
        entered *= rng.uniform(0.5, 1.8)
    entered = np.maximum(np.rint(entered), 1)
    silent = rng.random() < settings.gap_share
    start = float(rng.uniform(span_s[0], max(span_s[0] + 1, span_s[1] - settings.gap_s)))
    return Transponder(
        "B" if class_b else "A",
        mmsi,
        to_stern - ship.length_m / 2,
        to_starboard - ship.width_m / 2,
        to_bow_m=int(entered[0]),
        to_stern_m=int(entered[1]),
        to_port_m=int(entered[2]),
        to_starboard_m=int(entered[3]),
        heading=bool(rng.random() >= lacking),
        compass_error_deg=float(rng.normal(0.0, 1.0)) * settings.heading_sigma_deg,
        silence_s=(start, start + settings.gap_s) if silent else None,
    )


def antenna_offset_m(transponder: Transponder, heading_rad: float) -> tuple[float, float]:
    """East and north of the antenna from the hull's middle, metres."""
    ahead, port = transponder.antenna_ahead_m, transponder.antenna_port_m
    east = ahead * sin(heading_rad) - port * cos(heading_rad)
    north = ahead * cos(heading_rad) + port * sin(heading_rad)
    return east, north
