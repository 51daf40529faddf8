"""The drawing of a track: north up, to scale, inside its frame."""

from datetime import UTC, datetime, timedelta
from itertools import pairwise

import pytest

from app.ais.drawing import HEIGHT_PX, WIDTH_PX, draw
from app.ais.service import Track
from app.tables.ais import AisPosition

NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)


def track(*places: tuple[float, float]) -> Track:
    """Return a track of one piece through places (lat, lon)."""
    piece = [
        AisPosition(fix_time=NOON + timedelta(minutes=n), lat_deg=lat, lon_deg=lon)
        for n, (lat, lon) in enumerate(places)
    ]
    return Track(mmsi=211_000_001, pieces=[piece], truncated=False)


def points(line: str) -> list[tuple[float, float]]:
    """Return the pixels of an SVG line."""
    return [(float(x), float(y)) for x, _, y in (pair.partition(",") for pair in line.split())]


def test_north_is_up_and_metres_are_alike() -> None:
    """A square of 1 km by 1 km is a square, its north side above, within the frame."""
    side_lat = 1000 / 111_320
    side_lon = side_lat / 0.5  # cos 60 degrees
    drawing = draw(track((60, 10), (60, 10 + side_lon), (60 + side_lat, 10 + side_lon)))
    assert drawing is not None
    (x0, y0), (x1, y1), (x2, y2) = points(drawing.lines[0])
    assert y0 == pytest.approx(y1, abs=0.2)
    assert x1 == pytest.approx(x2, abs=0.2)
    assert x1 - x0 == pytest.approx(y1 - y2, rel=0.01)
    assert y2 < y1
    assert all(0 <= x <= WIDTH_PX and 0 <= y <= HEIGHT_PX for x, y in points(drawing.lines[0]))
    assert drawing.scale_m / drawing.scale_px == pytest.approx(1000 / (x1 - x0), rel=0.01)
    assert (drawing.first, drawing.last) == ((x0, y0), (x2, y2))


def test_a_track_across_180_degrees_is_short() -> None:
    """A vessel that crosses the antimeridian makes even steps, not a line round the globe."""
    drawing = draw(track((0, 179.99), (0, -180.0), (0, -179.99)))
    assert drawing is not None
    steps = [after[0] - before[0] for before, after in pairwise(points(drawing.lines[0]))]
    assert steps[0] == pytest.approx(steps[1], abs=0.2)
    assert steps[0] > 0


def test_a_vessel_at_its_berth_is_a_dot() -> None:
    """The jitter of a receiver at rest is not blown up to fill the frame."""
    drawing = draw(track((53.5, 10), (53.50001, 10.00001), (53.5, 10.00001)))
    assert drawing is not None
    xs = [x for x, _ in points(drawing.lines[0])]
    assert max(xs) - min(xs) < 30


def test_a_long_track_is_thinned_and_keeps_its_end() -> None:
    """Ten thousand fixes become at most about two thousand points, the last one kept."""
    drawing = draw(track(*((53 + n * 1e-5, 10.0) for n in range(10_000))))
    assert drawing is not None
    drawn = points(drawing.lines[0])
    assert len(drawn) <= 2_001
    assert drawn[-1] == drawing.last
    assert drawing.last[1] < drawing.first[1]


def test_no_positions_no_drawing() -> None:
    """A vessel that never said where it was has none."""
    assert draw(Track(mmsi=1, pieces=[], truncated=False)) is None
