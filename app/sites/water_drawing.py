"""A series of water levels as a small drawing: time to the right, metres up, broken at gaps."""

import math
from dataclasses import dataclass

from app.sites.water import LONGEST_GAP, Series

WIDTH_PX = 960
HEIGHT_PX = 280
_LEFT_PX, _EDGE_PX = 70, 24
_MOST_POINTS = 1500
_SMALLEST_M = 0.1


@dataclass(frozen=True, slots=True)
class Drawing:
    """Lines (SVG `points`) in px, and where the lowest and highest level are written."""

    lines: list[str]
    lowest_m: float
    highest_m: float
    lowest_px: float
    highest_px: float


def draw(series: Series) -> Drawing | None:
    """Fit a series into the drawing; None for one without readings."""
    readings = series.readings
    if not readings:
        return None
    begin, end = readings[0][0], readings[-1][0]
    span_s = max((end - begin).total_seconds(), 1.0)
    lowest, highest = min(level for _, level in readings), max(level for _, level in readings)
    px_per_m = (HEIGHT_PX - 2 * _EDGE_PX) / max(highest - lowest, _SMALLEST_M)
    px_per_s = (WIDTH_PX - _LEFT_PX - _EDGE_PX) / span_s
    every = math.ceil(len(readings) / _MOST_POINTS)
    lines: list[list[str]] = [[]]
    before = begin
    for index, (moment, level_m) in enumerate(readings):
        if moment - before > LONGEST_GAP:
            lines.append([])
        elif index % every and index < len(readings) - 1:
            before = moment
            continue
        before = moment
        x = _LEFT_PX + (moment - begin).total_seconds() * px_per_s
        y = HEIGHT_PX - _EDGE_PX - (level_m - lowest) * px_per_m
        lines[-1].append(f"{x:.1f},{y:.1f}")
    return Drawing(
        lines=[" ".join(points) for points in lines],
        lowest_m=lowest,
        highest_m=highest,
        lowest_px=HEIGHT_PX - _EDGE_PX,
        highest_px=round(HEIGHT_PX - _EDGE_PX - (highest - lowest) * px_per_m, 1),
    )
