"""A gauge's table: what is read, and what is refused by line."""

from datetime import UTC, datetime

import pytest

from app.errors import Invalid
from app.sites.water_csv import parse_levels


@pytest.mark.parametrize(
    "text",
    [
        "time,level_m\n2026-11-22T14:00:00Z,39.5\n2026-11-22T14:10:00Z,39.75\n",
        "\ufeff2026-11-22T15:10:00+01:00;39,75\n2026-11-22 15:00:00;39,50",
        "# gauge\nTIME\tLEVEL_M\n2026-11-22T14:00:00Z\t39.5\n\n2026-11-22T14:10:00Z\t39.75",
    ],
)
def test_tables_of_all_kinds_mean_the_same(text: str) -> None:
    """Commas, semicolons, tabs, zones and decimal commas are read; readings come in order."""
    assert parse_levels(text, "Europe/Berlin") == [
        (datetime(2026, 11, 22, 14, 0, tzinfo=UTC), 39.5),
        (datetime(2026, 11, 22, 14, 10, tzinfo=UTC), 39.75),
    ]


def test_the_gauge_datum_is_added() -> None:
    """A level above the gauge's own zero becomes one above the ellipsoid."""
    ((_, level_m),) = parse_levels("2026-11-22T14:00:00Z,4.5", "UTC", 35.0)
    assert level_m == 39.5


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no readings"),
        ("time,level_m", "no readings"),
        ("when,level_m\n2026-11-22T14:00:00Z,1", "line 1 has when"),
        ("2026-11-22T14:00:00Z,39,5", "line 1: has 3 columns .* semicolons"),
        ("2026-11-22T14:00:00Z", "1 columns"),
        ("22.11.2026 14:00,1", "line 1: .* is no time"),
        ("2026-11-22T14:00:00Z,high", "no level"),
        ("2026-11-22T14:00:00Z,nan", "within"),
        ("2026-11-22T14:00:00Z,1e9", "within"),
        ("2026-11-22T14:00:00Z,1\n2026-11-22T15:00:00+01:00,2", "line 2: .* twice"),
    ],
)
def test_what_is_no_series_is_refused_by_line(text: str, reason: str) -> None:
    """The line and the fix are named."""
    with pytest.raises(Invalid, match=reason):
        parse_levels(text, "UTC")
