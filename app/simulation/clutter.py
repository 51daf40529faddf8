"""What fills a real shore between the things one would name: hedges, sheds, cars, masts, hills.

Nothing here is a landmark or moves. It is drawn after everything else ashore, so that a harbour's
landmarks stay where they are when something is added.
"""

import numpy as np

from app.simulation import structures
from app.simulation.mesh import Colour, MeshBuilder, Surface, rgb
from app.simulation.structures import Point

_HILLS = rgb(86, 98, 84)
_REED = (rgb(128, 118, 74), rgb(104, 110, 58), rgb(84, 98, 52), rgb(140, 124, 84))
_CARS = (rgb(210, 210, 208), rgb(40, 42, 46), rgb(120, 122, 126), rgb(150, 34, 30),
         rgb(36, 60, 110))  # fmt: skip
_HOUSES = (rgb(198, 194, 182), rgb(150, 84, 66), rgb(172, 160, 138), rgb(120, 124, 128))
_TILES = (rgb(112, 62, 50), rgb(78, 76, 76), rgb(96, 90, 84))
_STEEL = rgb(150, 154, 156)


def add_clutter(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Add all of it to a mesh in the harbour's own frame; `land_m` is the quays' height."""
    _add_hills(b, rng)
    _add_hedges(b, rng, land_m)
    _add_reeds(b, rng, land_m)
    _add_houses(b, rng, land_m)
    _add_masts(b, rng, land_m)
    _add_vehicles(b, rng, land_m)
    _add_pallets(b, rng, land_m)


def _pick(rng: np.random.Generator, colours: tuple[Colour, ...]) -> Colour:
    return colours[int(rng.integers(len(colours)))]


def _add_hills(b: MeshBuilder, rng: np.random.Generator) -> None:
    """Close the horizon: two ridges, the farther one higher."""
    for y, low, high in ((3800.0, 14.0, 34.0), (3950.0, 30.0, 78.0)):
        x = np.linspace(-3600, 3600, 91)
        waves = np.zeros_like(x)
        for number, span in enumerate((620.0, 240.0, 95.0, 33.0), start=1):
            waves += np.sin(x / span + float(rng.uniform(0, 6.3))) / number
        waves = (waves - waves.min()) / np.ptp(waves)
        top = low + (high - low) * waves + rng.uniform(0, 3, len(x))
        foot = np.column_stack([x, np.full(len(x), y), np.full(len(x), -2.0)])
        b.strip(foot, np.column_stack([x, np.full(len(x), y), top]), _HILLS, Surface.FOLIAGE)


def _add_hedges(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Add belts of trees too far away to be told apart."""
    for _ in range(26):
        x, y = float(rng.uniform(-950, 950)), float(rng.uniform(1120, 2300))
        for i in range(int(rng.integers(4, 12))):
            size = float(rng.uniform(9, 19))
            foot = (x + i * size * 0.5, y + float(rng.normal(0, 6)), land_m)
            structures.add_bush(b, rng, foot, size)


def _add_reeds(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Cover the peninsula behind its wall with scrub, thick along the edge."""
    for _ in range(260):
        y = 474.0 + float(rng.gamma(2.0, 13.0))
        right = -40.0 - (y - 470.0) * 0.13
        x = float(rng.uniform(-340, right))
        if -210 < x < -160 and y > 545:
            continue  # the shed stands there
        size = float(rng.uniform(1.6, 4.6))
        structures.add_bush(b, rng, (x, y, land_m), size, colour=_pick(rng, _REED))


def _add_houses(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Add small houses and sheds with pitched roofs, near and far."""
    for _ in range(70):
        x, y = float(rng.uniform(-900, 900)), float(rng.uniform(1110, 2100))
        width, height = float(rng.uniform(12, 34)), float(rng.uniform(4, 10))
        structures.add_gabled(
            b, "House", (x, x + width), (y, y + float(rng.uniform(9, 16))),
            (land_m, land_m + height), (_pick(rng, _HOUSES), _pick(rng, _TILES)),
            Surface.MASONRY if height > 6 else Surface.SHEETING,
        )  # fmt: skip
    for x, y in ((300.0, 606.0), (345.0, 600.0), (420.0, 596.0)):
        place = x + float(rng.uniform(-8, 8))
        structures.add_gabled(
            b, "House", (place, place + float(rng.uniform(18, 30))), (y, y + 14),
            (land_m, land_m + float(rng.uniform(4, 7))),
            (_pick(rng, _HOUSES), _pick(rng, _TILES)), Surface.MASONRY,
        )  # fmt: skip


def _post(b: MeshBuilder, foot: Point, height_m: float, thickness_m: float) -> None:
    x, y, z = foot
    b.beam((x, y, z), (x, y, z + height_m), thickness_m, _STEEL)


def _add_masts(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Add lamp posts along the quays, pylons, and thin chimneys behind."""
    for i in range(16):
        x, y = 95.0 + 26 * i, 598.0 - 1.2 * i
        _post(b, (x, y, land_m), 11.0, 0.3)
        b.beam((x, y, land_m + 11.0), (x - 2.2, y - 1.0, land_m + 11.4), 0.3, _STEEL)
    for i in range(8):
        _post(b, (-330.0 + 36 * i, 560.0, land_m), 9.0, 0.3)
    for i in range(7):
        x, y = -900.0 + 300 * i, 1900.0 + 90 * i
        for side in (-5.0, 5.0):
            b.beam((x + side, y, land_m), (x, y, land_m + 52.0), 0.9, _STEEL)
        for height, reach in ((32.0, 13.0), (42.0, 10.0)):
            z = land_m + height
            b.beam((x - reach, y, z), (x + reach, y, z), 0.8, _STEEL)
    for _ in range(7):
        foot = (float(rng.uniform(-800, 800)), float(rng.uniform(1500, 2800)), land_m)
        _post(b, foot, float(rng.uniform(30, 85)), float(rng.uniform(1.0, 2.6)))


def _add_vehicles(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Park cars and vans on the quays."""
    for _ in range(60):
        if rng.random() < 0.6:
            x = float(rng.uniform(100, 480))
            y = 594.0 - (x - 78) * 0.049 + float(rng.uniform(4, 40))
        else:
            x, y = float(rng.uniform(-330, -150)), float(rng.uniform(585, 600))
        long, high = (4.4, 1.5) if rng.random() < 0.7 else (6.5, 2.8)
        paint = _pick(rng, _CARS)
        low, waist, top = (land_m + 0.3 + share * high for share in (0.0, 0.6, 1.0))
        b.box((x, x + long), (y, y + 1.9), (low, waist), paint)
        cabin = (x + 0.7, x + long - 0.8), (y + 0.1, y + 1.8), (waist, top)
        b.box(*cabin, rgb(44, 50, 56), roof=paint)


def _add_pallets(b: MeshBuilder, rng: np.random.Generator, land_m: float) -> None:
    """Leave crates, bins and heaps of goods about the yards."""
    for _ in range(90):
        right = rng.random() < 0.55
        x = float(rng.uniform(95, 420) if right else rng.uniform(-380, -70))
        y = float(rng.uniform(600, 640) if right else rng.uniform(640, 800))
        size, high = float(rng.uniform(1.5, 6.0)), float(rng.uniform(0.8, 3.2))
        tint = int(rng.integers(70, 190))
        paint = rgb(tint, int(tint * rng.uniform(0.8, 1.0)), int(tint * rng.uniform(0.6, 1.0)))
        b.box((x, x + size), (y, y + size * 0.6), (land_m, land_m + high), paint)
