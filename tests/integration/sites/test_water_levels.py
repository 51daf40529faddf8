"""A site's water level: a constant or a series, over REST and as a page, as fusion takes it."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.sites.water import level_at, levels_at
from app.tables.identity import User
from app.tables.sites import Site
from app.tables.water import WaterLevelSource
from tests.factories.sites import make_site

START = datetime(2026, 11, 22, 6, 0, tzinfo=UTC)
TABLE = "time,level_m\n" + "".join(
    f"{(START + timedelta(hours=hours)).isoformat()},{level}\n"
    for hours, level in ((0, 39.0), (1, 40.0), (2, 41.0), (8, 39.0))
)


@pytest.fixture
def site(database: Database) -> Site:
    """Give a site whose constant level is 39.6 m."""
    with database.writing() as session:
        return make_site(session, water_level_m=39.6)


@pytest.mark.parametrize(
    ("minutes", "level_m", "source"),
    [
        (0, 39.0, WaterLevelSource.SERIES),
        (30, 39.5, WaterLevelSource.SERIES),
        (120, 41.0, WaterLevelSource.SERIES),
        (180, 39.6, WaterLevelSource.GAP),
        (-1, 39.6, WaterLevelSource.GAP),
        (481, 39.6, WaterLevelSource.GAP),
    ],
)
def test_the_level_is_read_between_readings_and_never_across_gaps(
    client: TestClient,
    database: Database,
    site: Site,
    minutes: int,
    level_m: float,
    source: WaterLevelSource,
) -> None:
    """Interpolated within the series; in gaps and outside of it the constant holds, and says so."""
    moment = START + timedelta(minutes=minutes)
    with database.reading() as session:
        assert level_at(session, site, moment).source is WaterLevelSource.CONSTANT
        assert levels_at(session, site, [moment]) == [level_at(session, site, moment)]
    path = f"/api/v1/sites/{site.id}"
    stored = client.post(f"{path}/water-levels", content=TABLE)
    assert stored.status_code == 200, stored.text
    with database.reading() as session:
        level = level_at(session, site, moment)
        assert levels_at(session, site, [moment, START]) == [level, level_at(session, site, START)]
    assert (level.level_m, level.source) == (pytest.approx(level_m), source)
    asked = client.get(f"{path}/water-level", params={"at": moment.isoformat()}).json()
    assert (asked["level_m"], asked["source"]) == (pytest.approx(level_m), source.value)


def test_a_series_is_summed_up_replaced_and_removed(client: TestClient, site: Site) -> None:
    """Readings, extremes and gaps are told; a broken table changes nothing; removal leaves none."""
    path = f"/api/v1/sites/{site.id}/water-levels"
    stored = client.post(path, content=TABLE).json()
    assert (stored["readings"], stored["lowest_m"], stored["highest_m"]) == (4, 39.0, 41.0)
    assert [gap["hours"] for gap in stored["gaps"]] == [6.0]
    refused = client.post(path, content="2026-11-22T14:00:00Z,deep")
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "table"
    assert client.get(path).json() == stored
    written = client.get(f"{path}.csv").text
    assert client.post(path, content=written).json() == stored
    assert client.post(path, params={"offset_m": 1.0}, content=TABLE).json()["lowest_m"] == 40.0
    assert client.delete(path).status_code == 204
    assert client.get(path).json()["readings"] == 0


def test_the_page_shows_the_series_and_refuses_a_wrong_one(
    browser_of: Callable[[User], TestClient], admin: User, site: Site
) -> None:
    """Empty, uploaded, drawn with its gap, and an error at the field."""
    browser = browser_of(admin)
    page = f"/sites/{site.id}/water-levels"
    assert "No series" in browser.get(page).text
    wrong = {"file": ("tide.csv", b"2026-11-22,x", "text/csv")}
    refused = browser.post(page, data={"offset_m": "0"}, files=wrong)
    assert refused.status_code == 422
    assert "no level" in refused.text
    good = {"file": ("tide.csv", TABLE.encode(), "text/csv")}
    assert browser.post(page, data={"offset_m": "0"}, files=good).status_code == 303
    shown = browser.get(page).text
    assert shown.count("track__line") == 2
    assert "1 gap of more than 3 hours" in shown
    assert browser.post(f"{page}/delete").status_code == 303
    assert "No series" in browser.get(page).text
