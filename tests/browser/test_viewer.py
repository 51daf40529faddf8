"""The viewer: drawings stand where the numbers say, and the view is the reviewer's own."""

from collections.abc import Callable
from math import hypot
from typing import Any

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import MakeRun
from tests.browser.review_page import ReviewPage

NEAR_PX = 0.5
Poses = list[dict[str, Any]]


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give a run that these tests only look at."""
    return make_run()


def expect_drawn_at(review: ReviewPage, pose: dict[str, Any]) -> None:
    """Check box, plane and detection against the pose's numbers and the photograph's place."""
    review.settle()
    shown = review.geometry()
    scale = shown["scale"] / pose["image"]["width_px"]

    def screen(point: list[float]) -> tuple[float, float]:
        # (0, 0) is the centre of the first pixel: half a pixel from the photograph's corner.
        return (point[0] + 0.5) * scale + shown["x"], (point[1] + 0.5) * scale + shown["y"]

    found = pose["detection"]
    corners = [
        [found[f"{x}_px"], found[f"{y}_px"]] for x, y in (("x1", "y1"), ("x2", "y1"), ("x2", "y2"))
    ]
    for selector, points in (
        (".overlay-line.layer-box:not(.is-bow)", pose["corners_in_image_px"]),
        (".overlay-line.layer-corrected", pose["segments_px"]["corrected"]),
        (".overlay-line.layer-detection", corners),
    ):
        drawn = review.drawn_points(selector)
        assert drawn, selector
        for point in points:
            u, v = screen(point)
            assert min(hypot(u - x, v - y) for x, y in drawn) < NEAR_PX, (selector, point, scale)


def shown_pose(review: ReviewPage, poses: Poses) -> dict[str, Any]:
    """Return the pose that is shown."""
    return next(pose for pose in poses if pose["id"] == review.pose_id)


def zooms(review: ReviewPage) -> list[Callable[[], None]]:
    """Give the ways to another zoom, in an order that goes near and far."""
    page = review.page
    box = review.viewer.bounding_box()
    assert box is not None
    middle = (box["x"] + box["width"] * 0.4, box["y"] + box["height"] * 0.6)

    def wheel(delta: float) -> None:
        page.mouse.move(*middle)
        page.mouse.wheel(0, delta)

    def drag() -> None:
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 37.5, middle[1] - 21.25, steps=4)
        page.mouse.up()

    return [
        lambda: None,
        lambda: review.press("-", "-", "-"),
        lambda: review.press("z"),
        lambda: wheel(-700),
        drag,
        lambda: wheel(-1500),
        lambda: wheel(3000),
        lambda: page.set_viewport_size({"width": 1024, "height": 768}),
    ]


def test_drawings_stand_where_the_numbers_say(review: ReviewPage, poses: Poses) -> None:
    """Box, water plane and detection lie within half a pixel of the pose's numbers, at any zoom."""
    scales = set()
    for change in zooms(review):
        change()
        expect_drawn_at(review, shown_pose(review, poses))
        scales.add(round(review.geometry()["scale"], 1))
    assert len(scales) >= 4
    assert max(scales) > 2 * min(scales)
    review.press("0")
    for _ in range(5):
        review.press("j")
        review.wait_for_photograph()
        expect_drawn_at(review, shown_pose(review, poses))


def test_the_view_survives_moving_on(review: ReviewPage, run_id: int, poses: Poses) -> None:
    """A zoom and place chosen by hand stay at the next pose, if it can be seen there."""
    width, height = poses[0]["image"]["width_px"], poses[0]["image"]["height_px"]

    def inside(pose: dict[str, Any]) -> bool:
        box = pose["detection"]
        points = [*pose["corners_in_image_px"], [box["x1_px"], box["y1_px"]]]
        points.append([box["x2_px"], box["y2_px"]])
        return all(30 < u < width - 30 and 30 < v < height - 30 for u, v in points)

    index = next(i for i in range(len(poses) - 1) if inside(poses[i]) and inside(poses[i + 1]))
    review.open(run_id, poses[index]["id"])
    review.press("z")
    box = review.viewer.bounding_box()
    assert box is not None
    review.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    review.page.mouse.wheel(0, -20)
    review.settle()
    chosen = review.geometry()
    expect(review.page.locator("[data-part=framing]")).to_have_text("Free view")
    review.press("j")
    review.wait_for_photograph()
    assert review.pose_id == poses[index + 1]["id"]
    assert review.geometry() == pytest.approx(chosen, abs=0.01)


def test_a_far_pose_comes_into_sight_at_the_chosen_zoom(review: ReviewPage, poses: Poses) -> None:
    """Zoomed far in, the next pose is brought to the middle and the zoom stays."""
    review.press("z")
    box = review.viewer.bounding_box()
    assert box is not None
    review.page.mouse.move(box["x"] + 8, box["y"] + 8)
    review.page.mouse.wheel(0, -2500)
    review.settle()
    chosen = review.geometry()
    review.press("j")
    review.wait_for_photograph()
    shown = review.geometry()
    assert shown["scale"] == pytest.approx(chosen["scale"], abs=0.01)
    pose = shown_pose(review, poses)
    found = pose["detection"]
    scale = shown["scale"] / pose["image"]["width_px"]
    middle = (found["x1_px"] + found["x2_px"]) / 2 * scale + shown["x"]
    assert 0 < middle < shown["width"]


def test_z_changes_between_box_and_image(review: ReviewPage) -> None:
    """Z shows the whole photograph and, pressed again, the box as before."""
    framing = review.page.locator("[data-part=framing]")
    fitted = review.geometry()
    review.press("z")
    expect(framing).to_have_text("Fit image")
    whole = review.geometry()
    assert whole["scale"] <= whole["width"] + 0.5
    review.press("z")
    expect(framing).to_have_text("Fit box")
    assert review.geometry() == pytest.approx(fitted, abs=0.01)


def test_a_click_on_another_box_selects_it(review: ReviewPage, run_id: int, poses: Poses) -> None:
    """Clicking into another pose's box makes it the current one."""
    images = [pose["image"]["id"] for pose in poses]
    before = next(i for i in range(len(poses) - 1) if images[i] == images[i + 1])
    review.open(run_id, poses[before]["id"])
    other = poses[before + 1]
    review.press("z")
    review.wait_for_photograph()
    shown = review.geometry()
    scale = shown["scale"] / other["image"]["width_px"]
    box = review.viewer.bounding_box()
    assert box is not None
    found = other["detection"]
    u, v = (found["x1_px"] + found["x2_px"]) / 2, (found["y1_px"] + found["y2_px"]) / 2
    review.page.mouse.click(
        box["x"] + (u + 0.5) * scale + shown["x"], box["y"] + (v + 0.5) * scale + shown["y"]
    )
    review.settle()
    assert review.pose_id == other["id"]
