"""Everyone can register: axe finds nothing, small screens hide nothing, fingers suffice."""

from typing import Literal

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.axe import findings
from tests.browser.register_page import RegisterPage
from tests.browser.registrable import make_registrable, true_keypoints


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_in_the_editor(
    page: Page, api: httpx2.Client, scheme: Literal["light", "dark"]
) -> None:
    """Names, roles and contrast hold in every tab, with layers open and a keypoint waiting."""
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": 1024, "height": 768})
    editor = RegisterPage(page)
    editor.open(make_registrable(api, 9).viewport_id)
    for tab in ("Keypoint", "Landmarks", "Methods", "Readiness"):
        editor.tab(tab)
        assert findings(page) == [], tab
    page.get_by_role("button", name="Layers").click()
    assert findings(page, "[data-part=layers]") == []
    editor.press("Escape")
    editor.click_photograph(300, 300)
    editor.field("Latitude").fill("nowhere")
    editor.field("Latitude").press("Enter")
    expect(editor.alert("is no coordinate")).to_be_visible()
    assert findings(page) == []


@pytest.mark.parametrize("size", [(1024, 768), (720, 450)])
def test_everything_is_in_reach_on_a_small_screen(
    page: Page, api: httpx2.Client, size: tuple[int, int]
) -> None:
    """Nothing is cut off sideways, and saving, registering and the layers can be reached."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    editor = RegisterPage(page)
    editor.open(make_registrable(api, 6).viewport_id)
    wider = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert page.evaluate(wider) <= 0
    for name in ("Undo", "Save", "Register", "Layers", "Show all"):
        button = page.locator(".register").get_by_role("button", name=name, exact=True)
        button.scroll_into_view_if_needed()
        expect(button).to_be_in_viewport()


def test_a_finger_places_and_drags(page: Page, api: httpx2.Client) -> None:
    """A tap begins a keypoint, and a finger that misses a mark by a little still takes it."""
    editor = RegisterPage(page)
    editor.open(make_registrable(api, 7).viewport_id)
    touch = page.context.new_cdp_session(page)

    def send(kind: str, *points: tuple[float, float]) -> None:
        fingers = [{"x": x, "y": y} for x, y in points]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    x, y = editor.to_page(200, 400)
    send("touchStart", (x, y))
    send("touchEnd")
    expect(editor.mark("Point 1")).to_be_visible()
    name = true_keypoints()[5]["name"]
    before = editor.pixel(name)
    x, y = editor.middle_of(editor.mark(name))
    send("touchStart", (x + 18, y + 14))
    send("touchMove", (x + 38, y + 14))
    send("touchMove", (x + 48, y + 14))
    expect(page.locator(".loupe")).to_be_visible()
    send("touchEnd")
    editor.settle()
    moved = editor.pixel(name)
    assert moved[0] == pytest.approx(before[0] + 30 / editor.scale, abs=0.1)
    assert moved[1] == pytest.approx(before[1], abs=0.1)
