"""Everyone can work: axe finds nothing on the main pages, and zoomed text hides nothing."""

from typing import Literal

import pytest
from playwright.sync_api import Page, expect

from tests.browser.axe import findings
from tests.browser.conftest import Installation, MakeRun
from tests.browser.review_page import ReviewPage


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give one run to all of these tests."""
    return make_run("accessible")


def test_axe_finds_what_is_wrong(page: Page) -> None:
    """A button without a name is found: the engine runs, whatever the page's policy says."""
    page.goto("/sites")
    page.evaluate("() => document.querySelector('main').append(document.createElement('button'))")
    assert [finding.split(":")[0] for finding in findings(page)] == ["button-name"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_in_any_mode_of_the_review(
    page: Page, run_id: int, scheme: Literal["light", "dark"]
) -> None:
    """Names, roles and contrast hold while reviewing, editing, matching anew and marking."""
    page.emulate_media(color_scheme=scheme)
    review = ReviewPage(page)
    review.open(run_id)
    expect(page.locator(".place-map")).to_be_visible()
    assert findings(page) == []
    for key, shown in (
        ("e", "[data-handle=move]"),
        ("r", ".candidate"),
        ("m", "[data-part=missed-panel]"),
    ):
        review.press(key)
        expect(page.locator(shown).first).to_be_visible()
        assert findings(page) == [], key
        review.press("Escape")
    review.press("v")
    assert findings(page, "[data-part=layers]") == []


def test_axe_finds_nothing_on_the_main_pages(
    page: Page, run_id: int, installation: Installation
) -> None:
    """Lists, forms and details are as sound as the review."""
    viewport = installation.harbour.viewport_ids[0]
    paths = ("/sites", "/ais", "/models", "/runs", f"/runs/{run_id}", "/exports", "/admin/users")
    found = {}
    for path in (*paths, f"/viewports/{viewport}", "/account"):
        page.goto(path)
        wrong = findings(page)
        if wrong:
            found[path] = wrong
    assert found == {}


def test_at_twice_the_size_everything_is_in_reach(page: Page, run_id: int) -> None:
    """At 200 % zoom nothing is cut off sideways, and grading, editing and saving work."""
    page.set_viewport_size({"width": 720, "height": 450})  # what 1440 x 900 is at 200 %
    review = ReviewPage(page)
    review.open(run_id)
    wider = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert page.evaluate(wider) <= 0
    for name in ("Good", "Wrong match", "Edit", "Missed", "Layers"):
        button = page.locator(".review").get_by_role("button", name=name).first
        button.scroll_into_view_if_needed()
        expect(button).to_be_in_viewport()
    review.press("e")
    save = page.get_by_role("button", name="Save")
    save.scroll_into_view_if_needed()
    expect(save).to_be_in_viewport()
    assert page.evaluate(wider) <= 0


def test_a_tablet_has_room_for_a_finger(page: Page, run_id: int) -> None:
    """At 1024 x 768 no button is smaller than 24 px (WCAG 2.5.8), cut off, or under another."""
    page.set_viewport_size({"width": 1024, "height": 768})
    ReviewPage(page).open(run_id)
    wrong = page.eval_on_selector_all(
        ".review__top button, .review__bar button",
        """(buttons) => buttons.filter((one) => one.checkVisibility()).filter((one) => {
          const {x, y, width, height, right} = one.getBoundingClientRect();
          const hit = document.elementFromPoint(x + width / 2, y + height / 2);
          return Math.min(width, height) < 24 || right > innerWidth || !one.contains(hit);
        }).map((one) => one.title || one.textContent.trim())""",
    )
    assert wrong == []
