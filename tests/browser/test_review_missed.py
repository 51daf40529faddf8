"""Missed vessels: a box and one key, by mouse or by keyboard alone, in every image of a run."""

from collections.abc import Callable
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from app.operation.harbour_site import DETECTOR_NAME
from tests.browser.conftest import Installation, MakeRun
from tests.browser.review_page import ReviewPage
from tests.worker_process import wait_until

Pose = dict[str, Any]
Point = tuple[float, float]


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give one run to all of these tests."""
    return make_run("missed vessels")


@pytest.fixture(scope="module")
def images(run_id: int, poses_of: Callable[[int], list[Pose]]) -> dict[int, Pose]:
    """Give the images that no test has taken yet, each with one of its poses."""
    return {pose["image"]["id"]: pose for pose in poses_of(run_id)}


class Marker:
    """The review page in missed-vessel mode."""

    def __init__(self, review: ReviewPage, api: httpx2.Client, pose: Pose) -> None:
        self.review, self.page, self.api, self.pose = review, review.page, api, pose
        self.image_id = pose["image"]["id"]

    def on_page(self, u: float, v: float) -> Point:
        """Return where a pixel of the photograph stands on the page."""
        self.review.settle()
        at, viewer = self.review.geometry(), self.review.viewer.bounding_box()
        assert viewer is not None
        scale = at["scale"] / self.pose["image"]["width_px"]
        return (
            viewer["x"] + at["x"] + (u + 0.5) * scale,
            viewer["y"] + at["y"] + (v + 0.5) * scale,
        )

    def drag(self, start: Point, end: Point) -> None:
        """Drag from a pixel of the photograph to another."""
        self.page.mouse.move(*self.on_page(*start))
        self.page.mouse.down()
        self.page.mouse.move(*self.on_page(*end), steps=4)
        self.page.mouse.up()
        self.review.settle()

    def stored(self, run_id: int) -> list[dict[str, Any]]:
        """Ask the server for the missed vessels of the image."""
        url = f"/images/{self.image_id}/missed-vessels"
        found: list[dict[str, Any]] = self.api.get(url, params={"run_id": run_id}).json()["items"]
        return found


@pytest.fixture
def marker(page: Page, run_id: int, images: dict[int, Pose], api: httpx2.Client) -> Marker:
    """Give the page in missed-vessel mode at an image where nothing is marked."""
    _, pose = images.popitem()
    review = ReviewPage(page)
    review.open(run_id, pose["id"])
    review.press("m")
    expect(page.locator("[data-part=mode]")).to_contain_text("Missed vessels")
    return Marker(review, api, pose)


def test_a_drag_and_one_key_store_a_missed_vessel(marker: Marker, run_id: int) -> None:
    """The box lies where it was dragged, with the reason of the key, and is drawn on the image."""
    marker.drag((400, 300), (460, 330))
    marker.review.press("2")
    wait_until(lambda: len(marker.stored(run_id)) == 1, what="the missed vessel")
    (missed,) = marker.stored(run_id)
    assert missed["reason"] == "no_ais"
    box = [missed[name] for name in ("x1_px", "y1_px", "x2_px", "y2_px")]
    assert box == pytest.approx([400, 300, 460, 330], abs=1.5)
    expect(marker.page.locator(".overlay-missed text")).to_have_text("No AIS")
    marker.review.press("Escape")
    expect(marker.page.locator("[data-part=mode]")).to_be_hidden()
    expect(marker.page.locator(".overlay-missed")).to_be_attached()


def test_a_mark_can_be_changed_and_deleted(marker: Marker, run_id: int) -> None:
    """A corner stretches it, another key changes the reason, Delete takes it away."""
    marker.drag((200, 320), (260, 350))
    marker.review.press("1")
    expect(marker.page.locator(".overlay-missed")).to_have_count(1)
    marker.page.get_by_role("button", name="Missed vessel 1").click()
    marker.drag((260, 350), (300, 380))
    wait_until(lambda: marker.stored(run_id)[0]["version"] > 1, what="the larger box")
    assert marker.stored(run_id)[0]["x2_px"] == pytest.approx(300, abs=1.5)
    marker.review.viewer.focus()
    marker.review.press("3")
    wait_until(lambda: marker.stored(run_id)[0]["reason"] == "neither", what="the reason")
    expect(marker.page.locator(".overlay-missed text")).to_have_text("Neither")
    marker.review.press("Delete")
    wait_until(lambda: marker.stored(run_id) == [], what="the mark to be gone")
    expect(marker.page.locator(".overlay-missed")).to_have_count(0)


def test_the_keyboard_alone_marks_a_vessel(marker: Marker, run_id: int) -> None:
    """N puts a box in the middle of the view, keys move and size it, a digit stores it."""
    marker.review.press("n")
    drawn = marker.page.locator(".overlay-drawn .overlay-line.layer-missed")
    before = drawn.bounding_box()
    marker.review.press("ArrowRight", "ArrowRight", "ArrowUp", "s", "Shift+S")
    after = drawn.bounding_box()
    assert before is not None
    assert after is not None
    assert after["x"] - before["x"] == pytest.approx(20 - 5.5, abs=1)
    assert after["y"] - before["y"] == pytest.approx(-10, abs=1)
    assert after["width"] - before["width"] == pytest.approx(11, abs=1)
    marker.review.press("4")
    wait_until(lambda: len(marker.stored(run_id)) == 1, what="the missed vessel")
    assert marker.stored(run_id)[0]["reason"] == "cost_too_high"


def test_a_finger_draws_a_box(marker: Marker, run_id: int) -> None:
    """On a tablet a finger draws, and a button gives the reason."""
    session = marker.page.context.new_cdp_session(marker.page)
    (ax, ay), (bx, by) = marker.on_page(500, 380), marker.on_page(560, 420)
    for kind, points in (
        ("touchStart", [{"x": ax, "y": ay}]),
        ("touchMove", [{"x": (ax + bx) / 2, "y": (ay + by) / 2}]),
        ("touchMove", [{"x": bx, "y": by}]),
        ("touchEnd", []),
    ):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    marker.page.get_by_role("button", name="1 Not detected").click()
    wait_until(lambda: len(marker.stored(run_id)) == 1, what="the missed vessel")
    assert marker.stored(run_id)[0]["x1_px"] == pytest.approx(500, abs=2)


def test_an_image_without_any_pose_is_reviewed_too(
    page: Page, api: httpx2.Client, installation: Installation
) -> None:
    """Where nothing was matched the whole image is shown, and its vessels can be marked."""
    asked = {
        "viewport_id": installation.harbour.viewport_ids[0],
        "detector": DETECTOR_NAME,
        "preset": "paper",
        "parameters": {"maximum_cost": 1e-6},
    }
    run_id = api.post("/runs", json=asked).json()["id"]
    wait_until(lambda: api.get(f"/runs/{run_id}").json()["status"] == "succeeded", what="the run")
    made = {"run_id": run_id, "unit": "image", "order": "time"}
    queue = api.post("/review-queues", json=made).json()["id"]
    page.goto(f"/runs/{run_id}/review?queue={queue}")
    review = ReviewPage(page)
    review.wait()
    expect(page.locator("[data-part=vessel-kind]")).to_contain_text("No box was made here")
    first = api.get(f"/runs/{run_id}/images", params={"limit": 1}).json()["items"][0]["image"]
    review.press("m")
    marker = Marker(review, api, {"image": first})
    marker.drag((300, 300), (350, 330))
    review.press("3")
    wait_until(lambda: len(marker.stored(run_id)) == 1, what="the missed vessel")
