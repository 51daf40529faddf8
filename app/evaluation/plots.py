"""Plots as values: where axes, curves and points lie in a drawing, for a page or an SVG file.

Coordinates are those of the drawing, 720 x 400. A plot says of itself in words what it shows, gives
each curve a dash of its own beside its colour, and each point may lead somewhere.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

WIDTH, HEIGHT = 720, 400
LEFT, RIGHT, TOP, BOTTOM = 62, 18, 16, 52
COLOURS = ("#0072b2", "#a86400", "#00805d", "#a3487d", "#6b7280", "#c0392b")
DASHES = ("", "7 4", "2 3", "10 3 2 3", "4 4", "1 4")


@dataclass(frozen=True, slots=True)
class Tick:
    """A mark on an axis: where it lies and what is written there."""

    at: float
    text: str


@dataclass(frozen=True, slots=True)
class Curve:
    """A line (SVG `points`) with its name, colour and dash."""

    label: str
    points: str
    colour: str
    dash: str


@dataclass(frozen=True, slots=True)
class Point:
    """A dot that leads somewhere; `words` say what it is."""

    x: float
    y: float
    colour: str
    href: str
    words: str


@dataclass(frozen=True, slots=True)
class Spread:
    """A box from the first to the third quartile with its median, about a place on the x axis."""

    x: float
    low: float
    middle: float
    high: float


@dataclass(frozen=True, slots=True)
class Plot:
    """A drawing with its words."""

    title: str
    x_label: str
    y_label: str
    x_ticks: Sequence[Tick]
    y_ticks: Sequence[Tick]
    curves: Sequence[Curve] = ()
    points: Sequence[Point] = ()
    spreads: Sequence[Spread] = ()
    remark: str = ""


def place_x(share: float) -> float:
    """Return where a share of the x axis lies."""
    return round(LEFT + share * (WIDTH - LEFT - RIGHT), 1)


def place_y(share: float) -> float:
    """Return where a share of the y axis lies; y grows upwards."""
    return round(HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM), 1)


def shares_x() -> list[Tick]:
    """Mark an x axis from 0 to 1."""
    return [Tick(place_x(n / 5), f"{n / 5:g}") for n in range(6)]


def shares_y() -> list[Tick]:
    """Mark a y axis from 0 to 1."""
    return [Tick(place_y(n / 5), f"{n / 5:g}") for n in range(6)]


def curve(number: int, label: str, points: Iterable[tuple[float, float]]) -> Curve:
    """Draw a line through shares of both axes, in the colour and dash of its number."""
    text = " ".join(f"{place_x(x)},{place_y(y)}" for x, y in points)
    return Curve(label, text, COLOURS[number % len(COLOURS)], DASHES[number % len(DASHES)])
