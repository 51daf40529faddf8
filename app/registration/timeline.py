"""A camera's viewports on a time line: what each is valid for, its images, and times without any.

Drawn by the server as plain SVG coordinates: a row a viewport, time to the right, open ends running
to the edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from app.imagery.span import ImageSpan
from app.registration.overview import ViewportLine

WIDTH_PX = 960
ROW_PX = 26
_LEFT_PX, _RIGHT_PX, _TOP_PX = 190, 70, 22
_SHORTEST = timedelta(minutes=10)
_EDGE = 0.04  # of the time shown, on either side
_LEAST_PX = 2.0


@dataclass(frozen=True, slots=True)
class Row:
    """A viewport: its bar and its images' bar in px (left, width), none where there are none."""

    label: str
    href: str
    y_px: float
    bar: tuple[float, float]
    images: tuple[float, float] | None
    count: int


@dataclass(frozen=True, slots=True)
class Timeline:
    """Rows, the times without a viewport in px (left, width), and both ends of what is shown."""

    rows: list[Row]
    gaps: list[tuple[float, float]]
    begin: datetime
    end: datetime
    height_px: int
    left_px: int = _LEFT_PX
    right_px: int = WIDTH_PX - _RIGHT_PX
    top_px: int = _TOP_PX


def draw(lines: Sequence[ViewportLine], images: ImageSpan) -> Timeline | None:
    """Draw viewports with all images of their camera; None while no time is known."""
    moments = [
        moment
        for line in lines
        for moment in (line.viewport.valid_from, line.viewport.valid_until)
        if moment is not None
    ]
    moments += [moment for moment in (images.first_at, images.last_at) if moment is not None]
    if not lines or not moments:
        return None
    begin, end = min(moments), max(moments)
    margin = max((end - begin) * _EDGE, _SHORTEST)
    begin, end = begin - margin, end + margin
    px_per_s = (WIDTH_PX - _LEFT_PX - _RIGHT_PX) / (end - begin).total_seconds()

    def span(first: datetime | None, last: datetime | None) -> tuple[float, float]:
        left = _LEFT_PX + ((first or begin) - begin).total_seconds() * px_per_s
        right = _LEFT_PX + ((last or end) - begin).total_seconds() * px_per_s
        return round(left, 1), round(max(right - left, _LEAST_PX), 1)

    ordered = sorted(lines, key=lambda line: line.viewport.valid_from or begin)
    rows = [
        Row(
            label=line.viewport.name,
            href=f"/viewports/{line.viewport.id}",
            y_px=_TOP_PX + index * ROW_PX,
            bar=span(line.viewport.valid_from, line.viewport.valid_until),
            images=span(line.images.first_at, line.images.last_at) if line.images.count else None,
            count=line.images.count,
        )
        for index, line in enumerate(ordered)
    ]
    return Timeline(
        rows=rows,
        gaps=[span(first, last) for first, last in gaps_between(ordered, begin, end)],
        begin=begin,
        end=end,
        height_px=_TOP_PX + len(rows) * ROW_PX + 6,
    )


def gaps_between(
    ordered: Sequence[ViewportLine], begin: datetime, end: datetime
) -> list[tuple[datetime, datetime]]:
    """Return the times of [begin, end) in which no viewport is valid; `ordered` by their start."""
    gaps = []
    covered = begin
    for line in ordered:
        start = line.viewport.valid_from or begin
        if start > covered:
            gaps.append((covered, start))
        covered = max(covered, line.viewport.valid_until or end)
    if covered < end:
        gaps.append((covered, end))
    return gaps
