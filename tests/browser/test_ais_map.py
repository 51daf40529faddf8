"""The map of the traffic: what stands in the list is what the map shows, whenever it was loaded."""

from playwright.sync_api import Page, expect

from tests.browser.conftest import Installation


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
