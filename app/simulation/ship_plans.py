"""General arrangement plans: how each type of ship is put together.

Each plan draws its size and livery from a random generator and returns the ship's hulls by name.
Lengths and beams are whole metres, as AIS reports them.
"""

from enum import StrEnum

import numpy as np

from app.simulation.fittings import (
    BUFF,
    CREAM,
    DARK,
    GREY,
    WHITE,
    add_containers,
    add_funnel,
    add_house,
    add_mast,
    add_rails,
    add_wheelhouse,
)
from app.simulation.hulls import HullForm, HullPaint, add_hull
from app.simulation.mesh import Colour, Mesh, MeshBuilder, rgb

Plan = list[tuple[str, Mesh]]


class Fleet(StrEnum):
    """Two families of hulls, kept apart: one to build and train on, one to judge by."""

    TRAINING = "training"
    JUDGING = "judging"


_RED_BOOT, _BLACK_BOOT, _GREEN_BOOT = rgb(110, 34, 28), rgb(30, 30, 32), rgb(34, 74, 58)
_STEEL_DECK, _RED_DECK, _GREEN_DECK = rgb(96, 100, 102), rgb(122, 62, 50), rgb(60, 98, 78)
_TEAK = rgb(172, 136, 96)


def _pick(rng: np.random.Generator, colours: tuple[Colour, ...]) -> Colour:
    return colours[int(rng.integers(len(colours)))]


def _whole(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.integers(int(low), int(high) + 1))


def tug(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Harbour tug: high bow, low working deck aft, heavy fenders, house well forward."""
    judging = fleet is Fleet.JUDGING
    length, beam = _whole(rng, 24, 32), _whole(rng, 8, 11)
    form = HullForm(
        entrance=0.42 if judging else 0.34, run=0.16, bow_power=2.2 if judging else 2.7,
        stern_width=0.72, rake=0.05, flare=0.25, deck_m=(1.7, 1.9, 4.0), bulwark_m=0.9,
    )  # fmt: skip
    side = _pick(rng, (rgb(34, 40, 58), rgb(28, 30, 32), rgb(30, 62, 92), rgb(116, 32, 28)))
    house = _pick(rng, (CREAM, WHITE, rgb(196, 92, 40)))
    b = MeshBuilder()
    add_hull(b, form, HullPaint(_RED_BOOT, side, DARK, _GREEN_DECK), length, beam)
    shift = -0.08 if judging else 0.02
    x0, x1 = (shift - 0.08) * length, (shift + 0.22) * length
    add_house(b, (x0, x1), beam * 0.3, (1.9, 5.2), house, storeys=1, roof=GREY)
    add_wheelhouse(b, (x0 + 0.11 * length, x1 - 0.4), beam * 0.24, (5.2, 8.2), house)
    top = float(rng.uniform(12.0, 15.5))
    add_mast(b, x0 + 0.12 * length, (8.2, top), 0.28, WHITE if not judging else BUFF)
    for y in (-beam * 0.2, beam * 0.2):
        add_funnel(b, x0 - 0.4, y, 1.5, (2.2, 7.4), (house, DARK))
    b.cylinder((-0.22 * length, 0.0), 0.9, (1.7, 2.9), GREY, sides=8)  # towing winch
    b.beam((-0.3 * length, -beam * 0.33, 2.6), (-0.3 * length, beam * 0.33, 2.6), 0.35, DARK)
    for sign in (-1, 1):
        b.beam((-0.3 * length, sign * beam * 0.33, 1.7),
               (-0.3 * length, sign * beam * 0.33, 2.7), 0.35, DARK)  # fmt: skip
    return [("tug", b.build())]


def ferry(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Harbour ferry: a long cabin with an open upper deck, wheelhouse above the bow."""
    judging = fleet is Fleet.JUDGING
    length, beam = _whole(rng, 28, 36), _whole(rng, 7, 9)
    form = HullForm(
        entrance=0.2 if not judging else 0.34, run=0.1, bow_power=2.4, stern_width=0.86,
        rake=0.06, flare=0.2, deck_m=(1.3, 1.3, 1.9), bulwark_m=0.8,
    )  # fmt: skip
    side = _pick(rng, (rgb(176, 40, 36), rgb(28, 66, 120), rgb(224, 224, 222), rgb(30, 104, 84)))
    trim = WHITE if rng.random() < 0.6 else CREAM
    b = MeshBuilder()
    add_hull(b, form, HullPaint(_BLACK_BOOT, side, trim, _STEEL_DECK), length, beam)
    x0, x1 = -0.44 * length, 0.3 * length
    add_house(b, (x0, x1), beam * 0.44, (1.3, 3.9), side if judging else trim, roof=GREY)
    if not judging:
        add_house(b, (x0 - 0.2, x0 + 0.2 * length), beam * 0.41, (3.9, 6.0), side, roof=trim)
        awning = rgb(56, 92, 150)
        b.box((x0 + 0.24 * length, x1 - 0.16 * length), (-beam * 0.36, beam * 0.36), (6.0, 6.12),
              awning)  # fmt: skip
        for x in np.linspace(x0 + 0.25 * length, x1 - 0.17 * length, 5):
            for y in (-beam * 0.35, beam * 0.35):
                b.beam((x, y, 3.9), (x, y, 6.0), 0.1, WHITE)
    wheel = x1 - 0.14 * length if not judging else x0 + 0.3 * length
    add_wheelhouse(b, (wheel, wheel + 0.13 * length), beam * 0.3, (3.9, 6.9), trim)
    edge = [(x0, -beam * 0.43, 3.9), (x1, -beam * 0.43, 3.9), (x1, beam * 0.43, 3.9),
            (x0, beam * 0.43, 3.9)]  # fmt: skip
    add_rails(b, edge)
    add_mast(b, wheel + 0.5, (6.9, float(rng.uniform(9.5, 12.0))), 0.2, side)
    return [("ferry", b.build())]


def container_ship(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Feeder: flared bow, accommodation aft (or forward), containers in bays."""
    judging = fleet is Fleet.JUDGING
    length, beam = _whole(rng, 110, 150), _whole(rng, 18, 23)
    deck = float(rng.uniform(5.0, 7.0))
    form = HullForm(
        entrance=0.22, run=0.12, bow_power=2.1, stern_width=0.85, rake=0.03, flare=0.55,
        deck_m=(deck, deck, deck + 4.2), bulwark_m=1.1,
    )  # fmt: skip
    side = _pick(rng, (rgb(24, 44, 88), rgb(40, 94, 70), rgb(112, 34, 34), rgb(46, 50, 58),
                       rgb(120, 128, 132)))  # fmt: skip
    b = MeshBuilder()
    add_hull(b, form, HullPaint(_RED_BOOT, side, side, _RED_DECK), length, beam)
    top = deck + float(rng.uniform(13.5, 17.0))
    house = (0.3 * length, 0.38 * length) if judging else (-0.4 * length, -0.29 * length)
    add_house(b, house, beam * 0.36, (deck, top - 3), WHITE, roof=GREY, storeys=4)
    add_wheelhouse(b, (house[0] + 0.6, house[1] - 0.4), beam * 0.46, (top - 3, top), WHITE)
    add_mast(b, (house[0] + house[1]) / 2, (top, top + 7), 0.5, CREAM)
    funnel = (-0.36 * length) if judging else house[0] - 3.4
    add_funnel(b, funnel, 0.0, 4.2, (deck, top + 1.5), (side, DARK))
    bays = (-0.3 * length, 0.28 * length) if judging else (house[1] + 2, 0.36 * length)
    coaming = (bays[0], min(bays[1], 0.29 * length))  # farther forward the bow is too narrow
    b.box(coaming, (-beam * 0.44, beam * 0.44), (deck, deck + 1.4), rgb(104, 70, 56))
    add_containers(b, rng, bays, beam * 0.47, deck + 1.4, (1, 4))
    add_mast(b, 0.45 * length, (deck + 3, deck + 13), 0.45, CREAM, yards=(0.7,))
    for y in (-beam * 0.38, beam * 0.38):
        b.box((house[0] + 1, house[0] + 7), (y - 1.2, y + 1.2), (deck + 5, deck + 7.2),
              rgb(222, 96, 32))  # fmt: skip
    return [("container ship", b.build())]


def sailing_boat(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Sloop under sail: slim hull, low cabin, mast with main sail and jib (or ketch)."""
    judging = fleet is Fleet.JUDGING
    length, beam = _whole(rng, 9, 14), _whole(rng, 3, 4)
    form = HullForm(
        entrance=0.62, run=0.3, bow_power=1.9, stern_width=0.7, rake=0.1, flare=0.3,
        deck_m=(0.95, 0.9, 1.35), bulwark_m=0.0,
    )  # fmt: skip
    side = _pick(rng, (WHITE, WHITE, rgb(34, 56, 96), rgb(240, 238, 230), rgb(120, 36, 34)))
    b = MeshBuilder()
    add_hull(b, form, HullPaint(_RED_BOOT, side, side, _TEAK), length, beam)
    add_house(b, (-0.1 * length, 0.2 * length), beam * 0.28, (0.9, 1.55), WHITE)
    foot = (0.08 if not judging else 0.18) * length
    top = float(rng.uniform(1.15, 1.4)) * length
    b.cylinder((foot, 0.0), 0.11, (0.9, top), rgb(206, 206, 204), sides=6)
    canvas = rgb(236, 234, 226) if rng.random() < 0.8 else rgb(150, 60, 44)
    boom, sheet = 2.0, float(rng.uniform(-0.46, 0.46)) * beam
    clew = (-0.36 * length, sheet, boom)
    b.beam((foot, 0, boom), clew, 0.14, GREY)
    belly = ((foot + clew[0]) / 2, sheet * 0.75, (boom + top) / 2)
    b.face([(foot - 0.1, 0, boom), clew, belly], canvas, both_sides=True)
    b.face([(foot - 0.1, 0, boom), belly, (foot - 0.1, 0, top - 0.3)], canvas, both_sides=True)
    tack = (0.485 * length, 0.0, 1.4)
    jib_clew = (foot - 0.02 * length, sheet * 0.6, 1.9)
    b.face([tack, (foot, 0.0, top * 0.93), jib_clew], canvas, both_sides=True)
    if judging:
        mizzen = -0.34 * length
        b.cylinder((mizzen, 0.0), 0.09, (0.9, top * 0.72), rgb(206, 206, 204), sides=6)
        b.face([(mizzen, 0, 2.0), (-0.48 * length, sheet * 0.3, 2.0), (mizzen, 0, top * 0.7)],
               canvas, both_sides=True)  # fmt: skip
    return [("sailing boat", b.build())]


def launch(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Harbour launch: an open boat for round trips with a canopy, wheel stand amidships."""
    judging = fleet is Fleet.JUDGING
    length, beam = _whole(rng, 15, 22), _whole(rng, 4, 5)
    form = HullForm(
        entrance=0.4, run=0.22, bow_power=2.3, stern_width=0.6 if not judging else 0.9, rake=0.08,
        flare=0.25, deck_m=(1.0, 0.95, 1.8), bulwark_m=0.35,
    )  # fmt: skip
    side = _pick(rng, (rgb(28, 66, 130), rgb(30, 34, 40), rgb(150, 40, 36), rgb(220, 220, 214)))
    b = MeshBuilder()
    add_hull(b, form, HullPaint(_RED_BOOT, side, WHITE, _TEAK), length, beam)
    x0, x1 = -0.3 * length, 0.24 * length
    add_house(b, (x0, x1), beam * 0.36, (0.95, 2.5), WHITE, roof=CREAM)
    if judging:
        add_wheelhouse(b, (x1 - 0.16 * length, x1), beam * 0.32, (2.5, 4.3), WHITE)
    else:
        add_wheelhouse(b, (-0.42 * length, x0), beam * 0.26, (1.0, 3.4), _TEAK)
    add_mast(b, 0.27 * length, (1.5, float(rng.uniform(4.6, 6.0))), 0.12, WHITE)
    return [("launch", b.build())]


def inland_ship(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Inland cargo ship: long and low, hatch covers, wheelhouse right aft."""
    judging = fleet is Fleet.JUDGING
    length, beam = _whole(rng, 67, 105), _whole(rng, 8, 11)
    free = float(rng.uniform(0.9, 2.4))
    form = HullForm(
        entrance=0.1 if not judging else 0.16, run=0.07, bow_power=2.4, stern_width=0.7, rake=0.01,
        flare=0.2, deck_m=(free + 0.3, free, free + 1.7), bulwark_m=0.3,
    )  # fmt: skip
    side = _pick(rng, (rgb(28, 30, 36), rgb(36, 60, 100), rgb(92, 96, 98), rgb(58, 84, 72)))
    b = MeshBuilder()
    add_hull(b, form, HullPaint(_RED_BOOT, side, WHITE, _STEEL_DECK), length, beam)
    hold = (-0.3 * length, 0.4 * length)
    b.box(hold, (-beam * 0.4, beam * 0.4), (free, free + 1.2), rgb(80, 84, 88), roof=GREY)
    if judging:
        add_containers(b, rng, hold, beam * 0.37, free + 0.4, (1, 2))
    else:
        for x in np.arange(hold[0], hold[1] - 6, 6.4):
            b.box((x, x + 6), (-beam * 0.38, beam * 0.38), (free + 1.2, free + 1.6),
                  rgb(150, 156, 156))  # fmt: skip
    add_house(
        b, (-0.47 * length, -0.32 * length), beam * 0.37, (free, free + 2.6), WHITE, roof=GREY
    )
    wheel = -0.38 * length
    add_wheelhouse(b, (wheel, wheel + 4.2), beam * 0.28, (free + 2.6, free + 5.2), WHITE)
    add_mast(b, wheel + 1, (free + 5.2, free + 8.0), 0.16, WHITE)
    add_mast(b, 0.46 * length, (free + 1.2, free + 5.5), 0.16, WHITE, yards=())
    return [("inland cargo ship", b.build())]


def convoy(rng: np.random.Generator, fleet: Fleet) -> Plan:
    """Pusher with one or two barges in line ahead: several hulls that travel as one."""
    judging = fleet is Fleet.JUDGING
    pusher_m, barge_m, beam = _whole(rng, 16, 24), _whole(rng, 45, 76), _whole(rng, 9, 11)
    barges = 1 if judging else int(rng.integers(1, 3))
    total = pusher_m + barges * barge_m
    hulls: Plan = []
    for number in range(barges):
        middle = total / 2 - barge_m * (number + 0.5)
        hulls.append(
            (f"barge {number + 1}", _barge(rng, barge_m, beam, middle, foremost=not number))
        )
    hulls.append(("pusher", _pusher(rng, pusher_m, beam, -total / 2 + pusher_m / 2)))
    return hulls


def _barge(
    rng: np.random.Generator, length: float, beam: float, middle: float, *, foremost: bool
) -> Mesh:
    free = float(rng.uniform(0.8, 2.8))
    form = HullForm(
        entrance=0.1 if foremost else 0.03, run=0.03, bow_power=2.5, stern_width=0.98, rake=0.03,
        flare=0.1, deck_m=(free, free, free + 0.5), stem_width=0.75,
    )  # fmt: skip
    side = _pick(rng, (rgb(70, 50, 44), rgb(44, 48, 54), rgb(94, 88, 80), rgb(40, 60, 84)))
    local = MeshBuilder()
    add_hull(local, form, HullPaint(_BLACK_BOOT, side, side, _STEEL_DECK), length, beam)
    y = (-beam * 0.4, beam * 0.4)
    local.box((-0.42 * length, 0.36 * length), y, (free, free + 1.1), rgb(98, 86, 74), roof=DARK)
    if rng.random() < 0.6:
        heap = _pick(rng, (rgb(120, 104, 80), rgb(42, 42, 44), rgb(140, 96, 66)))
        for x in np.linspace(-0.34, 0.2, 4):
            outline = [(x * length, y[0] * 0.95), ((x + 0.15) * length, y[0] * 0.95),
                       ((x + 0.15) * length, y[1] * 0.95), (x * length, y[1] * 0.95)]  # fmt: skip
            local.prism(outline, free + 1.1, free + float(rng.uniform(2.0, 3.2)), heap, inset=0.25)
    else:
        add_containers(local, rng, (-0.4 * length, 0.34 * length), beam * 0.38, free + 0.4, (1, 2))
    return local.build().moved(np.eye(3), (middle, 0.0, 0.0))


def _pusher(rng: np.random.Generator, length: float, beam: float, middle: float) -> Mesh:
    form = HullForm(
        entrance=0.1, run=0.16, bow_power=3, stern_width=0.85, rake=0.0, flare=0.0,
        deck_m=(1.4, 1.5, 1.9), bulwark_m=0.5, stem_width=0.8,
    )  # fmt: skip
    side = _pick(rng, (rgb(30, 52, 96), rgb(32, 34, 38), rgb(124, 36, 32)))
    local = MeshBuilder()
    width = min(beam - 1, 9.0)
    add_hull(local, form, HullPaint(_BLACK_BOOT, side, side, _GREEN_DECK), length, width)
    add_house(local, (-0.3 * length, 0.2 * length), width * 0.38, (1.5, 4.2), WHITE, roof=GREY)
    add_house(local, (-0.1 * length, 0.18 * length), width * 0.3, (4.2, 6.6), WHITE, roof=GREY)
    wheel = (-0.04 * length, 0.17 * length)
    add_wheelhouse(local, wheel, width * 0.26, (6.6, 9.2), WHITE)
    add_mast(local, -0.02 * length, (9.2, float(rng.uniform(11.0, 13.0))), 0.2, WHITE)
    for y in (-width * 0.25, width * 0.25):
        add_funnel(local, -0.36 * length, y, 1.2, (1.5, 6.2), (side, DARK))
    return local.build().moved(np.eye(3), (middle, 0.0, 0.0))
