"""The map of the traffic and its coverage: lists, drawing and time agree, whenever loaded."""

import re

import sqlalchemy as sa
from playwright.sync_api import Page, expect

from app.db import now
from app.tables.ais import AisPosition
from app.tables.feeds import AisFeed
from app.tables.sites import Site
from tests.browser.conftest import Installation
from tests.factories.ais import MMSI, make_position
from tests.factories.world import make_feed


def test_a_vessel_of_the_list_is_the_one_on_the_map(page: Page, installation: Installation) -> None:
    """Once all tracks are there, a vessel chosen in the list tells its place and its flags."""
    page.goto(f"/sites/{installation.harbour.site_id}/map")
    vessels = page.locator("[data-part=vessels] button")
    expect(vessels.first).to_be_visible()
    page.wait_for_load_state("networkidle")
    expect(page.locator("[data-loading]")).to_have_count(0)
    chosen = page.locator("[data-part=chosen]")
    for number in range(vessels.count()):
        vessels.nth(number).click()
        expect(vessels.nth(number)).to_have_attribute("aria-pressed", "true")
        expect(chosen).to_contain_text("Heard")
        is_doubtful = "doubtful" in vessels.nth(number).inner_text()
        expect(chosen.get_by_text("none", exact=True)).to_have_count(0 if is_doubtful else 1)


# Of the canvas of vessels, the last one: how many pixels are drawn on.
DRAWN = """
() => {
  const canvas = [...document.querySelectorAll(".traffic-canvas")].at(-1);
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  return pixels.filter((value, index) => index % 4 === 3 && value > 0).length;
}
"""
TRACKS = """
() => [...document.querySelectorAll(".traffic-canvas")].slice(0, -1)
  .map((canvas) => getComputedStyle(canvas).visibility).sort().join()
"""


def test_time_plays_and_stops_on_the_map(page: Page, installation: Installation) -> None:
    """Vessels are drawn; while time plays the clock goes on, and a key stops it where it is."""
    page.goto(f"/sites/{installation.harbour.site_id}/map")
    expect(page.locator("[data-part=vessels] button").first).to_be_visible()
    expect(page.locator("[data-loading]")).to_have_count(0)
    page.wait_for_function(f"({DRAWN})() > 20")
    moment, play = page.locator("[data-part=moment]"), page.locator("[data-part=play]")
    page.locator("[data-part=slider]").press("ArrowLeft")
    begun = moment.inner_text()
    play.click()
    expect(play).to_have_text("Pause")
    expect(moment).not_to_have_text(begun)
    page.keyboard.press("p")
    expect(play).to_have_text("Play")
    page.wait_for_function(f"({TRACKS})() === 'hidden,visible'")
    expect(page).to_have_url(re.compile(r"[?&]t="))


def test_the_map_follows_what_is_heard_now(page: Page, installation: Installation) -> None:
    """A vessel that a feed hears is there within seconds, by itself; another moment ends it."""
    site_id = installation.harbour.site_id
    with installation.database.writing() as session:
        feed_id = make_feed(session, site_id, "live")["feed_id"]
        origin = session.get_one(Site, site_id)
        place = {"lat_deg": origin.origin_lat_deg, "lon_deg": origin.origin_lon_deg}
    try:
        page.goto(f"/sites/{site_id}/map?live=1")
        live = page.locator("[data-part=live]")
        expect(live).to_have_text("Live: waiting for the first report")
        with installation.database.writing() as session:
            site = session.get_one(Site, site_id)
            make_position(session, site, now(), mmsi=MMSI, **place).feed_id = feed_id
        expect(page.locator(f'[data-vessel="{MMSI}"]')).to_be_visible(timeout=15_000)
        expect(live).to_have_text("Live")
        page.locator("[data-part=slider]").press("ArrowLeft")
        expect(live).to_be_empty()
        expect(page.get_by_role("button", name="Follow live")).to_have_attribute(
            "aria-pressed", "false"
        )
    finally:
        with installation.database.writing() as session:
            session.execute(sa.delete(AisPosition).where(AisPosition.feed_id == feed_id))
            session.delete(session.get_one(AisFeed, feed_id))


def test_coverage_leads_from_images_to_the_map(page: Page, installation: Installation) -> None:
    """Each image of a day tells who was near and in view, and leads to the map at its moment."""
    page.goto(f"/sites/{installation.harbour.site_id}/coverage")
    expect(page.get_by_role("heading", name="AIS coverage")).to_be_visible()
    marks = page.locator(".coverage-strip a")
    rows = page.locator("table").last.locator("tbody tr")
    expect(marks).to_have_count(rows.count())
    with page.expect_download() as download:
        page.get_by_role("link", name="Download as CSV").click()
    lines = download.value.path().read_text().splitlines()
    assert lines[0] == "image_id,captured_at,camera,near,in_view,nearest_s"
    assert len(lines) == 1 + rows.count()
    rows.first.get_by_role("link", name="Show").click()
    expect(page).to_have_url(re.compile(rf"/sites/{installation.harbour.site_id}/map\?"))
    expect(page.locator("[data-part=vessels] button").first).to_be_visible()
