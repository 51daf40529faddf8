"""What stands on a deck: deckhouses with windows, masts, funnels, containers, rails.

Fittings are shared by all ship types, so that each type reads as an arrangement plan.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from app.simulation.mesh import Colour, MeshBuilder, Surface, rgb

GLASS = rgb(38, 48, 58)
WHITE = rgb(226, 226, 220)
CREAM = rgb(222, 204, 160)
GREY = rgb(128, 132, 134)
DARK = rgb(48, 50, 54)
BUFF = rgb(196, 150, 84)
CONTAINERS = (
    rgb(150, 52, 42), rgb(40, 78, 120), rgb(178, 96, 40), rgb(60, 104, 84), rgb(168, 168, 164),
    rgb(112, 38, 50), rgb(28, 50, 84), rgb(190, 176, 140), rgb(92, 96, 100),
)  # fmt: skip
_PROUD_M = 0.06  # windows lie this far outside their wall, so that they win the depth test


def add_house(
    builder: MeshBuilder,
    x_m: tuple[float, float],
    half_width_m: float,
    z_m: tuple[float, float],
    colour: Colour,
    *,
    roof: Colour | None = None,
    storeys: int = 1,
    panes: bool = True,
) -> None:
    """Add a deckhouse with a row of windows for each storey on all four sides."""
    y_m = (-half_width_m, half_width_m)
    builder.box(x_m, y_m, z_m, colour, roof=roof)
    storey_m = (z_m[1] - z_m[0]) / storeys
    for storey in range(storeys):
        sill = z_m[0] + storey_m * (storey + 0.42)
        head = z_m[0] + storey_m * (storey + 0.82)
        if panes:
            _add_windows(builder, x_m, half_width_m, (sill, head))


def _add_windows(
    builder: MeshBuilder, x_m: tuple[float, float], half_m: float, z_m: tuple[float, float]
) -> None:
    pane = max(0.7, (z_m[1] - z_m[0]) * 1.25)
    low, high = z_m
    for start, end in _panes(x_m, pane):
        for y, a, b in ((half_m + _PROUD_M, end, start), (-half_m - _PROUD_M, start, end)):
            builder.face(
                [(a, y, low), (b, y, low), (b, y, high), (a, y, high)], GLASS, Surface.GLASS
            )
    for start, end in _panes((-half_m, half_m), pane):
        for x, a, b in ((x_m[1] + _PROUD_M, start, end), (x_m[0] - _PROUD_M, end, start)):
            builder.face(
                [(x, a, low), (x, b, low), (x, b, high), (x, a, high)], GLASS, Surface.GLASS
            )


def _panes(span_m: tuple[float, float], pane_m: float) -> list[tuple[float, float]]:
    count = max(1, int((span_m[1] - span_m[0]) * 0.92 / (pane_m * 1.3)))
    pitch = (span_m[1] - span_m[0]) / count
    gap = pitch * 0.14
    return [(span_m[0] + i * pitch + gap, span_m[0] + (i + 1) * pitch - gap) for i in range(count)]


def add_wheelhouse(
    builder: MeshBuilder,
    x_m: tuple[float, float],
    half_width_m: float,
    z_m: tuple[float, float],
    colour: Colour,
) -> None:
    """Add a wheelhouse: wide windows all round under an overhanging roof."""
    sill = z_m[0] + 0.38 * (z_m[1] - z_m[0])
    head = z_m[1] - 0.12 * (z_m[1] - z_m[0])
    y_m = (-half_width_m, half_width_m)
    builder.box(x_m, y_m, (z_m[0], sill), colour)
    builder.box(x_m, y_m, (sill, head), GLASS, surface=Surface.GLASS)
    eave_x = (x_m[0] - 0.3, x_m[1] + 0.3)
    eave_y = (y_m[0] - 0.25, y_m[1] + 0.25)
    builder.box(eave_x, eave_y, (head, z_m[1]), colour, roof=WHITE)
    for x in (x_m[0], (x_m[0] + x_m[1]) / 2, x_m[1]):
        for y in y_m:
            builder.box((x - 0.09, x + 0.09), (y - 0.09, y + 0.09), (sill, head), colour)


def add_mast(
    builder: MeshBuilder,
    x_m: float,
    z_m: tuple[float, float],
    thickness_m: float,
    colour: Colour,
    *,
    yards: Sequence[float] = (0.55, 0.8),
) -> None:
    """Add a mast with cross-trees at the given shares of its height; its top is `z_m[1]`."""
    half = thickness_m / 2
    builder.box((x_m - half, x_m + half), (-half, half), z_m, colour)
    for share in yards:
        z = z_m[0] + share * (z_m[1] - z_m[0])
        reach = 0.16 * (z_m[1] - z_m[0])
        builder.box((x_m - half, x_m + half), (-reach, reach), (z, z + thickness_m), colour)


def add_funnel(
    builder: MeshBuilder,
    x_m: float,
    y_m: float,
    size_m: float,
    z_m: tuple[float, float],
    colours: tuple[Colour, Colour],
) -> None:
    """Add a funnel with a dark top."""
    band = z_m[1] - 0.25 * (z_m[1] - z_m[0])
    x, y = (x_m - size_m / 2, x_m + size_m / 2), (y_m - size_m / 2.6, y_m + size_m / 2.6)
    builder.box(x, y, (z_m[0], band), colours[0])
    builder.box(x, y, (band, z_m[1]), colours[1])


def add_rails(
    builder: MeshBuilder, edge: Sequence[tuple[float, float, float]], colour: Colour = WHITE
) -> None:
    """Add posts and a hand rail along a line of deck points."""
    points, up = np.asarray(edge, dtype=np.float64), np.array([0.0, 0.0, 1.0])
    for start, end in pairwise(points):
        builder.beam(start + up, end + up, 0.09, colour)
        for share in np.arange(0, 1, 2.5 / max(2.5, float(np.linalg.norm(end - start)))):
            foot = start + share * (end - start)
            builder.beam(foot, foot + up, 0.07, colour)


def add_containers(
    builder: MeshBuilder,
    rng: np.random.Generator,
    x_m: tuple[float, float],
    half_width_m: float,
    base_m: float,
    tiers: tuple[int, int],
) -> float:
    """Stack 40-foot containers in bays of seeded height; returns the top's height, metres."""
    bay_m, row_m, tier_m = 12.19, 2.44, 2.59
    rows = int(2 * half_width_m / row_m)
    bays = int((x_m[1] - x_m[0]) / (bay_m + 0.9))
    top = base_m
    for bay in range(bays):
        x = x_m[0] + bay * (bay_m + 0.9)
        usual = int(rng.integers(tiers[0], tiers[1] + 1))
        for row in range(rows):
            y = (row - rows / 2) * row_m
            count = max(0, usual - int(rng.random() < 0.3))
            for tier in range(count):
                z = base_m + tier * tier_m
                paint = CONTAINERS[int(rng.integers(len(CONTAINERS)))]
                outer = row in (0, rows - 1) or tier == count - 1
                if outer:
                    builder.box(
                        (x, x + bay_m), (y + 0.04, y + row_m - 0.04), (z, z + tier_m - 0.06), paint
                    )
                top = max(top, z + tier_m - 0.06)
    return top
