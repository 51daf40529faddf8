"""A vessel's track as a small drawing: north up, metres alike in both directions, with a scale.

Drawn by the server as plain SVG coordinates, because a picture of a few hundred metres of river
needs neither map tiles nor scripts.
"""

import math
from dataclasses import dataclass

from app.ais.service import Track
from app.tables.ais import AisPosition

WIDTH_PX = 640
HEIGHT_PX = 400
_MARGIN_PX = 36
_METRES_PER_DEG = 111_320.0
_SMALLEST_M = 50.0  # a vessel at its berth is a dot, not the jitter of its receiver
_MOST_POINTS = 2_000
_LONGEST_SCALE_PX = 140


@dataclass(frozen=True, slots=True)
class Drawing:
    """Lines (SVG `points`), single dots, first and last place in px, and the scale bar."""

    lines: list[str]
    dots: list[tuple[float, float]]
    first: tuple[float, float]
    last: tuple[float, float]
    scale_m: int
    scale_px: float


def draw(track: Track) -> Drawing | None:
    """Fit a track into the drawing; None for a vessel without positions."""
    positions = [position for piece in track.pieces for position in piece]
    if not positions:
        return None
    reference = positions[-1]
    east_m_per_deg = _METRES_PER_DEG * math.cos(math.radians(reference.lat_deg))

    def metres(position: AisPosition) -> tuple[float, float]:
        # The short way round, should the track cross 180 degrees.
        lon_deg = (position.lon_deg - reference.lon_deg + 180.0) % 360.0 - 180.0
        north_m = (position.lat_deg - reference.lat_deg) * _METRES_PER_DEG
        return lon_deg * east_m_per_deg, north_m

    places = [metres(position) for position in positions]
    west_m, east_m = min(x for x, _ in places), max(x for x, _ in places)
    south_m, north_m = min(y for _, y in places), max(y for _, y in places)
    px_per_m = min(
        (WIDTH_PX - 2 * _MARGIN_PX) / max(east_m - west_m, _SMALLEST_M),
        (HEIGHT_PX - 2 * _MARGIN_PX) / max(north_m - south_m, _SMALLEST_M),
    )
    middle_m = (west_m + east_m) / 2, (south_m + north_m) / 2

    def pixel(position: AisPosition) -> tuple[float, float]:
        x_m, y_m = metres(position)
        return (
            round(WIDTH_PX / 2 + (x_m - middle_m[0]) * px_per_m, 1),
            round(HEIGHT_PX / 2 - (y_m - middle_m[1]) * px_per_m, 1),
        )

    every = math.ceil(len(positions) / _MOST_POINTS)
    pieces = [[pixel(position) for position in _thinned(piece, every)] for piece in track.pieces]
    scale_m = _round_length(_LONGEST_SCALE_PX / px_per_m)
    return Drawing(
        lines=[" ".join(f"{x},{y}" for x, y in piece) for piece in pieces if len(piece) > 1],
        dots=[piece[0] for piece in pieces if len(piece) == 1],
        first=pieces[0][0],
        last=pieces[-1][-1],
        scale_m=scale_m,
        scale_px=round(scale_m * px_per_m, 1),
    )


def _thinned(piece: list[AisPosition], every: int) -> list[AisPosition]:
    """Return every so-manieth position and always the last one."""
    kept = piece[::every]
    return kept if kept[-1] is piece[-1] else [*kept, piece[-1]]


def _round_length(longest_m: float) -> int:
    """Return the largest 1, 2 or 5 times a power of ten that is not longer."""
    power = 10 ** math.floor(math.log10(max(longest_m, 1.0)))
    return int(max(step * power for step in (1, 2, 5) if step * power <= max(longest_m, 1.0)))
