"""Boxes are drawn with one drag and one key, changed, undone and kept, by mouse or by keyboard."""

from typing import Any

import httpx2
from playwright.sync_api import Page, expect

from tests.browser.boxes_page import BoxesPage


def _images(api: httpx2.Client) -> list[int]:
    """Return a camera's photographs in the order of time."""
    found = api.get("/images", params={"limit": 200}).json()["items"]
    of_one = [image for image in found if image["camera_id"] == found[0]["camera_id"]]
    return [image["id"] for image in sorted(of_one, key=lambda one: one["captured_at"])]


def _boxes(api: httpx2.Client, image_id: int) -> list[dict[str, Any]]:
    answer = api.get("/ground-truth/boxes", params={"image_id": image_id})
    items: list[dict[str, Any]] = answer.json()["items"]
    return items


def test_a_drag_and_a_key_draw_a_box(page: Page, base_url: str, api: httpx2.Client) -> None:
    """Drawn, given another class, moved by arrows, deleted, brought back, and complete."""
    first, second, *_ = _images(api)
    screen = BoxesPage(page, base_url, first)
    screen.drag((0.3, 0.3), (0.5, 0.45))
    screen.press("3")
    screen.drag((0.6, 0.6), (0.7, 0.7))
    screen.press("1")
    screen.expect_boxes("ship_moored", "ship")
    screen.press("j", "5")  # the first box is part of a convoy
    screen.expect_boxes("subvessel", "ship")
    before = _boxes(api, first)[0]
    screen.press("ArrowRight", "ArrowRight", "Shift+ArrowDown", "Escape")
    screen.expect_boxes("subvessel", "ship")
    moved = _boxes(api, first)[0]
    assert abs(moved["x1_px"] - before["x1_px"] - 2) < 0.02
    assert abs(moved["y2_px"] - before["y2_px"] - 0.1) < 0.02
    screen.press("j", "Delete")
    screen.expect_boxes("ship")
    screen.press("Backspace")
    screen.expect_boxes("subvessel", "ship")
    screen.press("Enter")
    expect(page).to_have_url(f"{base_url}/images/{second}/boxes")
    screen.expect_boxes()
    truth = api.get("/ground-truth/images", params={"image_id": first}).json()["items"]
    assert [one["is_complete"] for one in truth] == [True]
    screen.press("h")
    screen.expect_boxes("subvessel", "ship")


def test_the_keyboard_alone_draws(page: Page, base_url: str, api: httpx2.Client) -> None:
    """A new box in the middle, made wider, given a class; help tells the keys."""
    third = _images(api)[2]
    screen = BoxesPage(page, base_url, third)
    screen.press("b", "s", "s", "2")
    screen.expect_boxes("ship_leaving_frame")
    screen.press("?")
    expect(page.get_by_role("dialog")).to_contain_text("Boxes complete")
    screen.press("Escape", "j", "u")  # undone: the box is gone again
    screen.expect_boxes()
    assert _boxes(api, third) == []
