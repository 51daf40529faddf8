"""The chart of when a camera took photographs."""

from app.imagery.coverage import CELL_PX, DAYS_SHOWN, LABEL_PX, chart


def test_days_and_hours_have_their_places() -> None:
    """A row a day with its total, a column an hour, the busiest hour strongest."""
    drawn = chart([("2026-01-01 00", 1), ("2026-01-01 23", 3), ("2026-01-03 05", 2)])
    assert drawn is not None
    assert [(day, total) for day, _, total in drawn.days] == [("2026-01-01", 4), ("2026-01-03", 2)]
    assert [cell.x_px for cell in drawn.cells] == [
        LABEL_PX,
        LABEL_PX + 23 * CELL_PX,
        LABEL_PX + 5 * CELL_PX,
    ]
    assert max(drawn.cells, key=lambda cell: cell.strength).title == (
        "2026-01-01 23:00 UTC: 3 images"
    )


def test_only_the_newest_days_are_drawn() -> None:
    """A long history shows its last days and counts the others; no images, no chart."""
    drawn = chart([(f"2026-{month:02}-{day:02} 12", 1) for month in (1, 2) for day in range(1, 29)])
    assert drawn is not None
    assert len(drawn.days) == DAYS_SHOWN
    assert drawn.days[-1][0] == "2026-02-28"
    assert drawn.hidden_days == 56 - DAYS_SHOWN
    assert chart([]) is None
