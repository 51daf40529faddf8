"""What stands ashore: sheds, houses, tanks, cranes, towers, trees.

Each function adds one thing to a mesh of the harbour's own frame (x along the river to the right,
y across it away from the camera, z up from the mean water level) and, where the thing has corners
that a person would pick as landmarks, returns them by name.
"""

from itertools import pairwise
from math import cos, sin

import numpy as np

from app.simulation.fittings import CONTAINERS
from app.simulation.mesh import Colour, MeshBuilder, Surface, rgb

Point = tuple[float, float, float]
Landmarks = dict[str, Point]

BRICK = rgb(126, 66, 52)
ROOF = rgb(92, 84, 80)
CONCRETE = rgb(150, 146, 138)
LEAVES = (rgb(58, 78, 36), rgb(72, 92, 44), rgb(46, 66, 34), rgb(88, 98, 50))


def add_block(
    builder: MeshBuilder,
    name: str,
    x_m: tuple[float, float],
    y_m: tuple[float, float],
    z_m: tuple[float, float],
    colour: Colour,
    surface: Surface = Surface.MASONRY,
) -> Landmarks:
    """Add a flat-roofed building; its landmarks are the front roof corners."""
    builder.box(x_m, y_m, z_m, colour, roof=ROOF, surface=surface)
    return {
        f"{name}, left roof corner": (x_m[0], y_m[0], z_m[1]),
        f"{name}, right roof corner": (x_m[1], y_m[0], z_m[1]),
    }


def add_gabled(
    builder: MeshBuilder,
    name: str,
    x_m: tuple[float, float],
    y_m: tuple[float, float],
    z_m: tuple[float, float],
    colours: tuple[Colour, Colour],
    surface: Surface = Surface.SHEETING,
) -> Landmarks:
    """Add a shed with its ridge along x; landmarks are the front eaves and the ridge's ends."""
    wall, roof = colours
    (x0, x1), (y0, y1), (z0, z1) = x_m, y_m, z_m
    ridge_y, ridge_z = (y0 + y1) / 2, z1 + 0.22 * (y1 - y0) * 0.8
    builder.box(x_m, y_m, z_m, wall, surface=surface)
    builder.face([(x0, y0, z1), (x1, y0, z1), (x1, ridge_y, ridge_z), (x0, ridge_y, ridge_z)], roof)
    builder.face([(x1, y1, z1), (x0, y1, z1), (x0, ridge_y, ridge_z), (x1, ridge_y, ridge_z)], roof)
    builder.face([(x0, y1, z1), (x0, y0, z1), (x0, ridge_y, ridge_z)], wall, surface)
    builder.face([(x1, y0, z1), (x1, y1, z1), (x1, ridge_y, ridge_z)], wall, surface)
    doors = int((x1 - x0) / 14)
    for i in range(doors):
        a = x0 + (i + 0.3) * (x1 - x0) / doors
        builder.face(
            [(a, y0 - 0.2, z0), (a + 5, y0 - 0.2, z0), (a + 5, y0 - 0.2, z0 + 4.4),
             (a, y0 - 0.2, z0 + 4.4)], rgb(70, 76, 84),
        )  # fmt: skip
    return {
        f"{name}, left eaves": (x0, y0, z1),
        f"{name}, right eaves": (x1, y0, z1),
        f"{name}, left ridge end": (x0, ridge_y, ridge_z),
        f"{name}, right ridge end": (x1, ridge_y, ridge_z),
    }


def add_tank(
    builder: MeshBuilder, centre: tuple[float, float], radius_m: float, z_m: tuple[float, float]
) -> None:
    """Add a round storage tank with a shallow cone for a roof."""
    colour = rgb(176, 178, 172)
    builder.cylinder(centre, radius_m, z_m, colour, sides=22)
    top = (z_m[1], z_m[1] + radius_m * 0.15)
    builder.cylinder(centre, radius_m, top, rgb(190, 190, 184), sides=22, taper=0.1)


def add_chimney(
    builder: MeshBuilder, name: str, foot: Point, height_m: float, colour: Colour
) -> Landmarks:
    """Add a tapered chimney with bands; its landmark is the top."""
    x, y, z = foot
    radius = 0.035 * height_m
    builder.cylinder((x, y), radius, (z, z + height_m), colour, sides=10, taper=0.6)
    return {name: (x, y, z + height_m)}


def add_spire(builder: MeshBuilder, name: str, foot: Point, height_m: float) -> Landmarks:
    """Add a church tower with a green spire; its landmark is the tip."""
    x, y, z = foot
    half = 0.07 * height_m
    split = z + 0.5 * height_m
    builder.box((x - half, x + half), (y - half, y + half), (z, split), BRICK)
    outline = [
        (x - half, y - half),
        (x + half, y - half),
        (x + half, y + half),
        (x - half, y + half),
    ]
    builder.prism(outline, split, z + height_m, rgb(92, 130, 112), inset=0.02)
    return {name: (x, y, z + height_m)}


def add_slewing_crane(
    builder: MeshBuilder, name: str, foot: Point, height_m: float, turn_rad: float, colour: Colour
) -> Landmarks:
    """Add a quay crane: portal legs, tower, machine house, luffing jib; its tip is the landmark."""
    x, y, z = foot
    deck = z + 0.3 * height_m
    for dx in (-4.0, 4.0):
        for dy in (-4.0, 4.0):
            builder.beam((x + dx, y + dy, z), (x + dx * 0.6, y + dy * 0.6, deck), 1.0, colour)
    builder.box((x - 3.4, x + 3.4), (y - 3.4, y + 3.4), (deck - 1.2, deck), colour)
    neck = z + 0.5 * height_m
    for dx, dy in ((-1.5, -1.5), (1.5, -1.5), (1.5, 1.5), (-1.5, 1.5)):
        builder.beam((x + dx, y + dy, deck), (x + dx * 0.7, y + dy * 0.7, neck), 0.6, colour)
        builder.beam((x + dx, y + dy, deck), (x - dy * 0.7, y + dx * 0.7, neck), 0.35, colour)
    builder.box((x - 3, x + 3), (y - 3, y + 3), (neck, neck + 4.5), colour, surface=Surface.PAINT)
    ux, uy = cos(turn_rad), sin(turn_rad)
    tip = (x + ux * 0.5 * height_m, y + uy * 0.5 * height_m, z + height_m)
    apex = (x - ux * 2, y - uy * 2, z + 0.78 * height_m)
    for side in (-1.1, 1.1):
        root = (x + ux * 3 - uy * side, y + uy * 3 + ux * side, neck + 3)
        builder.beam(root, tip, 0.6, colour)
        builder.beam((x - uy * side, y + ux * side, neck + 4.5), apex, 0.5, colour)
    builder.beam(apex, tip, 0.25, colour)
    back = (x - ux * 7, y - uy * 7, neck + 3)
    builder.beam(apex, back, 0.4, colour)
    builder.box(
        (back[0] - 2, back[0] + 2), (back[1] - 2, back[1] + 2), (neck + 1, neck + 4), colour
    )
    return {f"{name}, jib tip": tip}


def add_gantry_crane(
    builder: MeshBuilder, name: str, foot: Point, height_m: float, colour: Colour
) -> Landmarks:
    """Add a container bridge with its boom over the water; its landmarks are the boom's ends."""
    x, y, z = foot
    boom_z = z + 0.62 * height_m
    for dx in (-9.0, 9.0):
        for dy in (0.0, 18.0):
            builder.beam((x + dx, y + dy, z), (x + dx, y + dy, boom_z), 1.5, colour)
        builder.beam((x + dx, y, z + 12), (x + dx, y + 18, z + 12), 1.2, colour)
    for dx in (-3.0, 3.0):
        builder.beam((x + dx, y - 38, boom_z), (x + dx, y + 34, boom_z), 1.6, colour)
        builder.beam((x + dx, y, boom_z), (x + dx, y + 6, z + height_m), 1.2, colour)
        builder.beam((x + dx, y + 6, z + height_m), (x + dx, y - 34, boom_z), 0.5, colour)
    builder.beam((x - 9, y, boom_z), (x + 9, y, boom_z), 1.5, colour)
    builder.box((x - 4, x + 4), (y + 14, y + 28), (boom_z, boom_z + 6), colour)
    return {f"{name}, head": (x, y + 6, z + height_m)}


def add_tree(builder: MeshBuilder, rng: np.random.Generator, foot: Point, height_m: float) -> None:
    """Add a tree: a trunk and a crown of leafy lumps."""
    x, y, z = foot
    builder.cylinder((x, y), 0.03 * height_m, (z, z + 0.4 * height_m), rgb(74, 62, 50), sides=5)
    leaf = LEAVES[int(rng.integers(len(LEAVES)))]
    for number in range(9):
        spread = 0.2 - 0.012 * number  # lumps rise and close in towards the top
        offset = rng.normal(0.0, spread * height_m, 2)
        level = (0.3 + 0.06 * number) * height_m
        middle = np.array([x + offset[0], y + offset[1], z + level])
        _add_lump(builder, rng, middle, float(rng.uniform(0.15, 0.24)) * height_m, leaf)


def add_bush(
    builder: MeshBuilder,
    rng: np.random.Generator,
    foot: Point,
    size_m: float,
    *,
    colour: Colour | None = None,
) -> None:
    """Add a bush that sits on the ground; without a colour it is one of the leaves'."""
    leaf = colour or LEAVES[int(rng.integers(len(LEAVES)))]
    middle = np.array([foot[0], foot[1], foot[2] + 0.25 * size_m])
    _add_lump(builder, rng, middle, size_m / 2, leaf, flatten=0.7)


def _add_lump(
    builder: MeshBuilder,
    rng: np.random.Generator,
    middle: np.ndarray[tuple[int], np.dtype[np.float64]],
    radius_m: float,
    colour: Colour,
    flatten: float = 0.85,
) -> None:
    around, upward = 7, 5
    tint = float(rng.uniform(0.75, 1.2))
    shade: Colour = (colour[0] * tint, colour[1] * tint, colour[2] * tint)
    turn = 2 * np.pi * np.arange(around) / around
    rings = []
    for level in range(upward):
        pitch = -0.5 * np.pi + np.pi * level / (upward - 1)
        reach = radius_m * np.cos(pitch) * rng.uniform(0.85, 1.15, around)
        ring = np.column_stack(
            [reach * np.cos(turn), reach * np.sin(turn),
             np.full(around, radius_m * np.sin(pitch) * flatten)]
        )  # fmt: skip
        rings.append(middle + ring)
    for low, high in pairwise(rings):
        for i in range(around):
            j = (i + 1) % around
            builder.face([low[i], low[j], high[j], high[i]], shade, Surface.FOLIAGE)


def add_container_yard(
    builder: MeshBuilder,
    rng: np.random.Generator,
    x_m: tuple[float, float],
    y_m: tuple[float, float],
    ground_m: float,
) -> None:
    """Add rows of stacked containers."""
    for y in np.arange(y_m[0], y_m[1], 9.0):
        for x in np.arange(x_m[0], x_m[1], 13.0):
            for tier in range(int(rng.integers(0, 4))):
                paint = CONTAINERS[int(rng.integers(len(CONTAINERS)))]
                z = ground_m + 2.6 * tier
                builder.box((x, x + 12.2), (y, y + 2.44), (z, z + 2.55), paint)


def add_dolphin(builder: MeshBuilder, name: str, foot: Point, top_m: float) -> Landmarks:
    """Add a mooring dolphin: three piles under a cap; its landmark is the light on top."""
    x, y, z = foot
    for dx, dy in ((-1.0, -0.6), (1.0, -0.6), (0.0, 1.0)):
        builder.cylinder((x + dx, y + dy), 0.5, (z, top_m - 0.8), rgb(62, 54, 46), sides=8)
    builder.cylinder((x, y), 1.7, (top_m - 0.8, top_m), rgb(104, 98, 88), sides=10)
    builder.cylinder((x, y), 0.12, (top_m, top_m + 1.7), rgb(196, 190, 60), sides=6)
    return {f"{name}, light": (x, y, top_m + 1.7)}
