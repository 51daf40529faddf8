"""The harbour ashore: where the banks run and what stands on them.

The plan is the same for every harbour, a river with a basin opening opposite the camera, as at
many old ports; the seed moves, sizes and colours all that stands on it. All of it is given in the
harbour's own frame (x along the river to the right, y across it away from the camera, z up from
the mean water level) and returned turned into the site's east, north, up.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import cos, radians, sin

import numpy as np

from app.domain.arrays import FloatArray
from app.simulation import structures
from app.simulation.clutter import add_clutter
from app.simulation.fittings import CONTAINERS
from app.simulation.mesh import Mesh, MeshBuilder, Surface, rgb
from app.simulation.structures import Point

LAND_M = 4.6  # quay level above the mean water level
NEAR_LAND_M = 5.5

# Corners of the far banks (x, y): the basin lies between the left and the right bank.
LEFT_BANK = ((-1500.0, 470.0), (-32.0, 470.0), (-105.0, 1100.0))
RIGHT_BANK = ((5.0, 1100.0), (78.0, 590.0), (1500.0, 520.0))
NEAR_QUAY = ((-90.0, 30.0), (-13.0, 30.0), (-14.5, 57.0), (-90.0, 64.0))

_GRASS, _YARD, _PAVING = rgb(104, 110, 66), rgb(138, 132, 122), rgb(120, 116, 110)
_WALL = rgb(84, 76, 66)


@dataclass(frozen=True, eq=False)
class Scenery:
    """The land as one mesh, and points that a person would pick as landmarks, both in ENU."""

    mesh: Mesh
    landmarks: dict[str, FloatArray]


def harbour_axes(view_azimuth_deg: float) -> FloatArray:
    """Rotation (3, 3) from the harbour's own frame to ENU for a camera that looks that way."""
    a = radians(view_azimuth_deg)
    return np.array([[cos(a), sin(a), 0.0], [-sin(a), cos(a), 0.0], [0.0, 0.0, 1.0]])


def build_scenery(rng: np.random.Generator, view_azimuth_deg: float) -> Scenery:
    """Build everything ashore from the seed's generator."""
    builder = MeshBuilder()
    marks: dict[str, Point] = {}
    _add_land(builder)
    for part in (_left_bank, _right_bank, _background, _skyline, _near_quay, _in_the_water):
        marks.update(part(builder, rng))
    add_clutter(builder, rng, LAND_M)  # last: it must not move what is drawn before
    to_enu = harbour_axes(view_azimuth_deg)
    return Scenery(
        builder.build().moved(to_enu, (0.0, 0.0, 0.0)),
        {name: to_enu @ np.array(point) for name, point in marks.items()},
    )


def _add_land(b: MeshBuilder) -> None:
    a, tip, inner = LEFT_BANK
    back, corner, far = RIGHT_BANK
    _ground(b, (a, tip, inner, (-1500.0, 1100.0)), LAND_M, rgb(112, 112, 76))
    _ground(b, (corner, far, (1500.0, 1100.0), back), LAND_M, _YARD)
    for x in np.arange(-2400, 2400, 400.0):
        for y in np.arange(1100, 3900, 400.0):
            b.face(
                [(x, y, LAND_M), (x + 400, y, LAND_M), (x + 400, y + 400, LAND_M),
                 (x, y + 400, LAND_M)], _GRASS, Surface.GROUND,
            )  # fmt: skip
    for start, end in ((a, tip), (tip, inner), (inner, back), (back, corner), (corner, far)):
        _quay_wall(b, start, end, LAND_M)
    _ground(b, NEAR_QUAY, NEAR_LAND_M, _PAVING, pieces=24)
    _quay_wall(b, NEAR_QUAY[1], NEAR_QUAY[2], NEAR_LAND_M, piece_m=1.5)
    _quay_wall(b, NEAR_QUAY[2], NEAR_QUAY[3], NEAR_LAND_M, piece_m=1.5)


def _ground(
    b: MeshBuilder,
    corners: tuple[tuple[float, float], ...],
    level_m: float,
    colour: tuple[float, float, float],
    pieces: int = 16,
) -> None:
    """Add level ground, cut into pieces because distortion bends long edges."""
    p00, p10, p11, p01 = (np.array((*c, level_m)) for c in corners)
    share = np.linspace(0, 1, pieces + 1)
    grid = [
        [(1 - v) * ((1 - u) * p00 + u * p10) + v * ((1 - u) * p01 + u * p11) for u in share]
        for v in share
    ]
    for row, above in pairwise(grid):
        for i in range(pieces):
            b.face([row[i], row[i + 1], above[i + 1], above[i]], colour, Surface.GROUND)


def _quay_wall(
    b: MeshBuilder,
    start: tuple[float, float],
    end: tuple[float, float],
    top_m: float,
    *,
    piece_m: float = 30.0,
) -> None:
    """Add a wall with its water to the right of start to end."""
    count = max(2, int(np.hypot(end[0] - start[0], end[1] - start[1]) / piece_m))
    share = np.linspace(0, 1, count + 1)[:, None]
    line = (1 - share) * np.array(start) + share * np.array(end)
    low = np.column_stack([line, np.full(count + 1, -2.5)])
    edge = np.column_stack([line, np.full(count + 1, top_m - 0.7)])
    top = np.column_stack([line, np.full(count + 1, top_m)])
    b.strip(low, edge, _WALL, Surface.SHEET_PILES)
    b.strip(edge, top, rgb(150, 144, 132))


def _left_bank(b: MeshBuilder, rng: np.random.Generator) -> dict[str, Point]:
    marks: dict[str, Point] = {
        "Peninsula, quay corner": (*LEFT_BANK[1], LAND_M),
    }
    for _ in range(70):
        y = float(rng.uniform(476, 520))
        x = float(rng.uniform(-330, -44 - (y - 470) * 0.15))
        structures.add_bush(b, rng, (x, y, LAND_M), float(rng.uniform(2.5, 6.5)))
    for _ in range(9):
        foot = (float(rng.uniform(-135, -75)), float(rng.uniform(510, 575)), LAND_M)
        structures.add_tree(b, rng, foot, float(rng.uniform(11, 19)))
    for row in range(2):
        for i in range(5):
            x = -380 + i * 34 + float(rng.uniform(-3, 3))
            top = LAND_M + float(rng.uniform(9, 15))
            structures.add_tank(b, (x, 610 + row * 45.0), float(rng.uniform(10, 14)), (LAND_M, top))
    structures.add_container_yard(b, rng, (-330, -120), (720, 800), LAND_M)
    marks |= structures.add_gabled(
        b, "Tank farm shed", (-205, -165), (560, 582), (LAND_M, LAND_M + 7),
        (rgb(170, 172, 168), rgb(120, 116, 110)),
    )  # fmt: skip
    marks |= structures.add_block(
        b, "Cold store", (-260, -180), (830, 880), (LAND_M, LAND_M + 19), rgb(178, 174, 160),
        Surface.SHEETING,
    )  # fmt: skip
    marks |= structures.add_slewing_crane(
        b, "Basin crane", (-112, 830, LAND_M), float(rng.uniform(44, 56)),
        float(rng.uniform(0.2, 2.4)), rgb(60, 150, 150),
    )  # fmt: skip
    pole = (-36.0, 473.0)
    b.cylinder(pole, 0.25, (LAND_M, LAND_M + 7), rgb(186, 44, 40), sides=6)
    b.box((-37.0, -35.0), (472.4, 473.6), (LAND_M + 5, LAND_M + 7), rgb(186, 44, 40))
    return marks | {"Basin entrance light": (pole[0], pole[1], LAND_M + 7)}


def _right_bank(b: MeshBuilder, rng: np.random.Generator) -> dict[str, Point]:
    marks: dict[str, Point] = {"Right quay corner": (*RIGHT_BANK[1], LAND_M)}
    x = 100.0
    for name in ("Shed 1", "Shed 2", "Shed 3"):
        width = float(rng.uniform(42, 62))
        wall = (rgb(96, 134, 160), rgb(196, 192, 180), rgb(150, 90, 70))[int(rng.integers(3))]
        marks |= structures.add_gabled(
            b, name, (x, x + width), (640, 668), (LAND_M, LAND_M + float(rng.uniform(7, 10))),
            (wall, structures.ROOF),
        )  # fmt: skip
        x += width + float(rng.uniform(5, 16))
    marks |= structures.add_block(
        b, "Customs house", (x + 4, x + 34), (600, 622), (LAND_M, LAND_M + 12), structures.BRICK
    )
    for i, turn in enumerate(rng.uniform(-0.5, 3.6, 3)):
        foot = (95.0 + 75 * i + float(rng.uniform(-10, 10)), 606.0 - 2 * i, LAND_M)
        colour = (rgb(50, 56, 62), rgb(58, 140, 146), rgb(196, 150, 60))[int(rng.integers(3))]
        height = float(rng.uniform(34, 46))
        marks |= structures.add_slewing_crane(
            b, f"Crane {i + 1}", foot, height, float(turn), colour
        )
    for i in range(26):
        paint = CONTAINERS[int(rng.integers(len(CONTAINERS)))]
        px, py = 110 + i * 11.0 + float(rng.uniform(-3, 3)), float(rng.uniform(612, 630))
        size = (12.2, 2.5, 2.6) if rng.random() < 0.4 else (5.2, 2.0, 1.9)
        b.box((px, px + size[0]), (py, py + size[1]), (LAND_M, LAND_M + size[2]), paint)
    for _ in range(26):
        foot = (float(rng.uniform(290, 520)), float(rng.uniform(575, 690)), LAND_M)
        structures.add_tree(b, rng, foot, float(rng.uniform(8, 15)))
    return marks


def _background(b: MeshBuilder, rng: np.random.Generator) -> dict[str, Point]:
    marks: dict[str, Point] = {}
    x = -760.0
    number = 1
    walls = (rgb(190, 186, 176), rgb(120, 128, 136), rgb(156, 106, 84), rgb(206, 204, 196))
    while x < 760:
        width, height = float(rng.uniform(50, 120)), float(rng.uniform(10, 24))
        y = float(rng.uniform(1130, 1400))
        wall = walls[int(rng.integers(len(walls)))]
        marks |= structures.add_block(
            b, f"Warehouse {number}", (x, x + width), (y, y + 40), (LAND_M, LAND_M + height), wall,
            Surface.SHEETING if rng.random() < 0.5 else Surface.MASONRY,
        )  # fmt: skip
        x += width + float(rng.uniform(8, 45))
        number += 1
    for i in range(4):
        foot = (-30.0 + 26 * i, 1112.0, LAND_M)
        b.cylinder(foot[:2], 11, (LAND_M, LAND_M + 42), rgb(186, 182, 170), sides=14)
    marks["Silo, right edge"] = (59.0, 1112.0, LAND_M + 42)
    for _ in range(150):
        foot = (float(rng.uniform(-900, 900)), float(rng.uniform(1105, 1900)), LAND_M)
        structures.add_tree(b, rng, foot, float(rng.uniform(9, 20)))
    for i in range(5):
        foot = (float(240 + 60 * i + rng.uniform(-8, 8)), 1500.0, LAND_M)
        marks |= structures.add_gantry_crane(b, f"Bridge {i + 1}", foot, 78.0, rgb(56, 96, 150))
    return marks


def _skyline(b: MeshBuilder, rng: np.random.Generator) -> dict[str, Point]:
    marks: dict[str, Point] = {}
    x = -1250.0
    number = 1
    while x < 1250:
        width, height = float(rng.uniform(30, 110)), float(rng.gamma(3.0, 9.0) + 12)
        y = float(rng.uniform(2000, 3300))
        grey = int(rng.integers(120, 200))
        corners = structures.add_block(
            b, f"Office {number}", (x, x + width), (y, y + 30), (LAND_M, LAND_M + height),
            rgb(grey, grey - 4, grey - 14),
        )  # fmt: skip
        if height > 45:
            marks |= corners
        x += width * float(rng.uniform(0.7, 1.5))
        number += 1
    chimney = (float(rng.uniform(-560, -420)), 1750.0, LAND_M)
    marks |= structures.add_chimney(b, "Chimney", chimney, 96, rgb(168, 160, 150))
    spire = (float(rng.uniform(120, 320)), 2200.0, LAND_M)
    marks |= structures.add_spire(b, "Church spire", spire, 98)
    tower = (float(rng.uniform(-260, -120)), 2900.0, LAND_M)
    marks |= structures.add_chimney(b, "Radio tower", tower, 190, rgb(172, 172, 170))
    b.cylinder(tower[:2], 13, (LAND_M + 108, LAND_M + 120), rgb(190, 190, 188), taper=0.8)
    return marks


def _near_quay(b: MeshBuilder, rng: np.random.Generator) -> dict[str, Point]:
    corner = NEAR_QUAY[2]
    z = NEAR_LAND_M
    box = (-26.0, -19.6), (46.0, 52.0), (z, z + 3.2)
    paint = CONTAINERS[int(rng.integers(len(CONTAINERS)))]
    b.box(*box, paint, roof=rgb(200, 202, 200))
    rail, up = rgb(64, 68, 70), np.array([0.0, 0.0, 1.0])
    for start, end in ((NEAR_QUAY[1], NEAR_QUAY[2]), (NEAR_QUAY[2], (-40.0, 59.3))):
        a, c = np.array((*start, z)), np.array((*end, z))
        for height in (0.45, 0.8, 1.15):
            b.beam(a + height * up, c + height * up, 0.07, rail)
        for share in np.linspace(0, 1, 16):
            foot = a + share * (c - a)
            b.beam(foot, foot + 1.2 * up, 0.1, rail)
    for dx in (-3.2, -4.1):
        b.cylinder((corner[0] + dx, 53.0), 0.22, (z, z + 1.6), rgb(206, 40, 34), sides=8)
    lamp = (corner[0] - 2.4, 55.0)
    b.cylinder(lamp, 0.16, (z, z + 3.4), rgb(34, 36, 36), sides=8)
    return {
        "Near quay, corner": (*corner, z),
        "Near quay, lamp": (*lamp, z + 3.4),
        "Near quay, container corner": (-19.6, 46.0, z + 3.2),
        "Near quay, container back corner": (-19.6, 52.0, z + 3.2),
    }


def _in_the_water(b: MeshBuilder, rng: np.random.Generator) -> dict[str, Point]:
    marks: dict[str, Point] = {}
    places = ((-31.0, 98.0), (33.0, 104.0), (-150.0, 458.0), (-90.0, 460.0), (118.0, 575.0))
    for number, (x, y) in enumerate(places, start=1):
        foot = (x + float(rng.uniform(-1.5, 1.5)), y + float(rng.uniform(-1.5, 1.5)), -4.0)
        top = float(rng.uniform(4.0, 5.2))
        marks |= structures.add_dolphin(b, f"Dolphin {number}", foot, top)
    return marks
