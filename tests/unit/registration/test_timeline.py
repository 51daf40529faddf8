"""The time line of a camera's viewports: bars, images, and times without a viewport."""

from datetime import UTC, datetime, timedelta

import pytest

from app.imagery.span import ImageSpan
from app.registration.overview import NO_IMAGES, ViewportLine
from app.registration.readiness import Readiness
from app.registration.timeline import WIDTH_PX, draw
from app.tables.sites import Viewport

START = datetime(2026, 3, 1, tzinfo=UTC)
READY = Readiness("Ready", "success", "", "")


def _line(name: str, first: float | None, last: float | None, images: ImageSpan) -> ViewportLine:
    """Give a viewport valid from one day until another."""
    times = [None if day is None else START + timedelta(days=day) for day in (first, last)]
    viewport = Viewport(id=1, name=name, valid_from=times[0], valid_until=times[1])
    return ViewportLine(viewport, 0, None, None, images, READY)


def _span(count: int, first: float, last: float) -> ImageSpan:
    return ImageSpan(count, START + timedelta(days=first), START + timedelta(days=last))


def test_viewports_stand_in_order_with_their_images_and_the_gaps_between() -> None:
    """Earlier ones first; open ends run to the edge; a time without any viewport is a gap."""
    lines = [
        _line("Later", 20, None, _span(5, 21, 30)),
        _line("First", 0, 10, _span(3, 1, 2)),
    ]
    timeline = draw(lines, _span(9, 1, 30))
    assert timeline is not None
    assert [row.label for row in timeline.rows] == ["First", "Later"]
    first, later = timeline.rows
    assert first.images is not None
    assert first.bar[0] < first.images[0]
    assert sum(first.images) < sum(first.bar) < later.bar[0]
    assert round(sum(later.bar)) == WIDTH_PX - 70
    inner = [gap for gap in timeline.gaps if gap[0] > first.bar[0]]
    assert [left for left, _ in inner] == [pytest.approx(sum(first.bar), abs=0.2)]
    assert len(timeline.gaps) == 2


def test_nothing_is_drawn_while_no_time_is_known() -> None:
    """A viewport that is always valid and has no image has no place in time yet."""
    assert draw([_line("Always", None, None, NO_IMAGES)], NO_IMAGES) is None
    assert draw([], NO_IMAGES) is None
    alone = draw([_line("Always", None, None, _span(1, 1, 1))], _span(1, 1, 1))
    assert alone is not None
    assert alone.gaps == []
