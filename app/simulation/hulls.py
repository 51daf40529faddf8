"""Hull forms: what makes a ship a ship and not a box.

A hull is lofted through sections from the stern to the stem. Each section knows its half breadth
at the waterline and at the deck and the deck's height there; a bow tapers to the stem, flares
outwards above the water and rises with the sheer. The hull begins at the waterline, since nothing
below it can be seen, and it reaches exactly the length and beam it is given.
"""

from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.simulation.mesh import Colour, MeshBuilder


@dataclass(frozen=True, slots=True)
class HullForm:
    """Proportions of a hull, all relative to its length or beam unless named in metres.

    `entrance`: part of the length over which the bow tapers; `run`: the same at the stern.
    `bow_power` above 2 gives a full bow, below 2 a fine one. `stern_width`: transom's share of the
    beam. `rake`: how far the stem overhangs the waterline. `flare`: how much narrower the
    waterline is than the deck at the bow. Deck heights above the water in metres at stern,
    amidships and stem; `bulwark_m` above the deck.
    """

    entrance: float
    run: float
    bow_power: float
    stern_width: float
    rake: float
    flare: float
    deck_m: tuple[float, float, float]
    bulwark_m: float = 0.0
    stem_width: float = 0.0


@dataclass(frozen=True, slots=True)
class HullPaint:
    """Colours from the waterline upwards: boot topping, side, bulwark's rim, deck."""

    boot: Colour
    side: Colour
    rim: Colour
    deck: Colour


def deck_height_m(form: HullForm, along: float) -> float:
    """Deck height above the water at `along` (0 stern, 1 stem), metres."""
    stern, middle, stem = form.deck_m
    aft, forward = max(0.0, 1 - along / 0.5), max(0.0, (along - 0.5) / 0.5)
    return middle + (stern - middle) * aft**2 + (stem - middle) * float(forward**2.2)


def half_breadth(form: HullForm, along: float) -> float:
    """Deck half breadth at `along` (0 stern, 1 stem) as a share of half the beam."""
    share = 1.0
    if along > 1 - form.entrance:
        t = (along - (1 - form.entrance)) / form.entrance
        share = form.stem_width + (1 - form.stem_width) * (1 - t**form.bow_power)
    elif along < form.run:
        t = 1 - along / form.run
        share = 1 - (1 - form.stern_width) * t**2
    return share


def add_hull(
    builder: MeshBuilder, form: HullForm, paint: HullPaint, length_m: float, beam_m: float
) -> None:
    """Add a hull about the middle of its length, x forward, y port, z up from the waterline."""
    alongs = _stations(form)
    lines = _lines(form, alongs, length_m, beam_m)
    colours = (paint.boot, paint.side, paint.side, paint.rim)
    for lower, upper, colour in zip(lines, lines[1:], colours, strict=False):
        port_low, port_up = lower[::-1], upper[::-1]  # bow to stern runs right, seen from port
        builder.strip(port_low, port_up, colour)
        mirrored = np.array([1.0, -1.0, 1.0])
        builder.strip(lower * mirrored, upper * mirrored, colour)
        builder.face(
            [lower[0], lower[0] * mirrored, upper[0] * mirrored, upper[0]], colour
        )  # transom
        if form.stem_width > 0:
            builder.face([lower[-1] * mirrored, lower[-1], upper[-1], upper[-1] * mirrored], colour)
    _add_deck(builder, lines[3], paint.deck)
    if form.bulwark_m > 0:
        _add_bulwark_inside(builder, lines[3], lines[4], paint.side)


def _stations(form: HullForm) -> FloatArray:
    bow = 1 - form.entrance * (1 - np.linspace(0, 1, 11) ** 0.8)
    stern = np.linspace(0, form.run, 5)
    middle = np.linspace(form.run, 1 - form.entrance, 5)[1:-1]
    return np.concatenate([stern, middle, bow])


def _lines(form: HullForm, alongs: FloatArray, length_m: float, beam_m: float) -> list[FloatArray]:
    """Port lines from stern to stem: waterline, boot top, mid side, deck edge, bulwark's rim."""
    lines = []
    for level in (0.0, 0.18, 0.6, 1.0, -1.0):
        points = []
        for along in alongs:
            deck = deck_height_m(form, along)
            share = 1.0 if level < 0 else level
            height = deck + form.bulwark_m if level < 0 else min(deck, deck * level)
            bow = max(0.0, (along - (1 - form.entrance)) / form.entrance)
            narrowing = 1 - form.flare * (1 - share) ** 1.3 * bow
            overhang = form.rake * length_m * (1 - share) * bow**3
            x = (along - 0.5) * length_m - overhang
            points.append((x, half_breadth(form, along) * narrowing * beam_m / 2, height))
        lines.append(np.array(points))
    return lines


def _add_deck(builder: MeshBuilder, edge: FloatArray, colour: Colour) -> None:
    mirrored = edge * (1.0, -1.0, 1.0)
    for i in range(len(edge) - 1):
        builder.face([mirrored[i], mirrored[i + 1], edge[i + 1], edge[i]], colour)


def _add_bulwark_inside(
    builder: MeshBuilder, deck: FloatArray, rim: FloatArray, colour: Colour
) -> None:
    """Show the inner side of the bulwark, seen across the deck."""
    shade = (colour[0] * 0.6, colour[1] * 0.6, colour[2] * 0.6)
    mirror = np.array([1.0, -1.0, 1.0])
    builder.strip(deck, rim, shade)
    builder.strip((deck * mirror)[::-1], (rim * mirror)[::-1], shade)
    builder.face([deck[0] * mirror, deck[0], rim[0], rim[0] * mirror], shade)
