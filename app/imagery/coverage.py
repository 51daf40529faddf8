"""When a camera took photographs: a small chart of images by day and hour, drawn by the server."""

from collections.abc import Sequence
from dataclasses import dataclass

DAYS_SHOWN = 31
CELL_PX = 18
LABEL_PX = 92
TOP_PX = 20


@dataclass(frozen=True, slots=True)
class Cell:
    """An hour with images: where it is drawn, how strong, and what it stands for."""

    x_px: int
    y_px: int
    strength: float
    title: str


@dataclass(frozen=True, slots=True)
class Coverage:
    """The chart: a row a day (newest last), a column an hour of UTC."""

    days: list[tuple[str, int, int]]
    """Day, its row's y in px, its images."""
    hours: list[tuple[str, int]]
    """Hour, its column's x in px."""
    cells: list[Cell]
    width_px: int
    height_px: int
    hidden_days: int


def chart(hourly: Sequence[tuple[str, int]]) -> Coverage | None:
    """Draw the last days with images from counts by `YYYY-MM-DD HH`; None without images."""
    all_days = sorted({hour[:10] for hour, _ in hourly})
    if not all_days:
        return None
    days = all_days[-DAYS_SHOWN:]
    row = {day: TOP_PX + index * CELL_PX for index, day in enumerate(days)}
    most = max(count for hour, count in hourly if hour[:10] in row)
    cells = [
        Cell(
            LABEL_PX + int(hour[11:]) * CELL_PX,
            row[hour[:10]],
            round(0.25 + 0.75 * count / most, 2),
            f"{hour}:00 UTC: {count} images",
        )
        for hour, count in hourly
        if hour[:10] in row
    ]
    totals = dict.fromkeys(days, 0)
    for hour, count in hourly:
        if hour[:10] in totals:
            totals[hour[:10]] += count
    return Coverage(
        days=[(day, row[day], totals[day]) for day in days],
        hours=[(f"{hour:02}", LABEL_PX + hour * CELL_PX) for hour in range(0, 24, 3)],
        cells=cells,
        width_px=LABEL_PX + 24 * CELL_PX + 70,
        height_px=TOP_PX + len(days) * CELL_PX + 2,
        hidden_days=len(all_days) - len(days),
    )
