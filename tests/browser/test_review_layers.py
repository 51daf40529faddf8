"""What is drawn over the photograph and told beside it: layers, facts, the map, times."""

import re
from collections.abc import Callable
from datetime import datetime
from typing import Any
from zoneinfo import ZoneInfo

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import MakeRun
from tests.browser.review_page import ReviewPage

Pose = dict[str, Any]
OFF_AT_FIRST = {
    "AIS position as reported": "reported",
    "AIS position at image time": "dead_reckoned",
    "Axes of the vessel": "axes",
}


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give one run to all of these tests: none changes it."""
    return make_run("layers")


@pytest.fixture(scope="module")
def poses(run_id: int, poses_of: Callable[[int], list[Pose]]) -> list[Pose]:
    """Give the poses of the run."""
    return poses_of(run_id)


@pytest.fixture
def review(page: Page, run_id: int, poses: list[Pose]) -> ReviewPage:
    """Give the open review page."""
    opened = ReviewPage(page)
    opened.open(run_id, poses[0]["id"])
    return opened


def test_each_layer_is_drawn_when_asked_for_and_remembered(review: ReviewPage) -> None:
    """V shows the layers; what is ticked is drawn, also after a reload."""
    page = review.page
    review.press("v")
    for label, layer in OFF_AT_FIRST.items():
        drawn = page.locator(f".overlay-pose.is-current .overlay-line.layer-{layer}").first
        expect(drawn).to_be_hidden()
        page.get_by_label(label).check()
        expect(drawn).to_be_visible()
    page.get_by_label("Horizon").check()
    expect(page.locator(".overlay-line.layer-horizon").first).to_be_visible()
    page.get_by_label("Detection").uncheck()
    page.reload()
    review.wait()
    expect(page.locator(".is-current .overlay-line.layer-axes").first).to_be_visible()
    expect(page.locator(".is-current .overlay-line.layer-detection")).to_be_hidden()


def test_other_vessels_from_ais_stand_where_they_were_heard(
    review: ReviewPage, run_id: int, poses: list[Pose], api: httpx2.Client
) -> None:
    """A vessel without a box is drawn on the water with its name and why it has none."""
    asked = {"run_id": run_id, "limit": 200}
    for pose in poses:
        url = f"/images/{pose['image']['id']}/vessels"
        others = [
            vessel
            for vessel in api.get(url, params=asked).json()["items"]
            if vessel["pose_id"] is None and len(vessel["segments"]["dead_reckoned"]) > 0
        ]
        if others:
            break
    else:
        pytest.skip("in this harbour every vessel has a box")
    review.open(run_id, pose["id"])
    review.press("v")
    review.page.get_by_label("Other vessels from AIS").check()
    labels = review.page.locator("text.layer-vessels")
    expect(labels).to_have_count(len(others))
    expect(labels.first).to_contain_text(others[0]["name"] or str(others[0]["mmsi"]))


def test_the_panel_tells_what_a_verdict_needs(review: ReviewPage, poses: list[Pose]) -> None:
    """Size, heading with its source, age, cost, correction, and the time in UTC and on site."""
    panel = review.page.locator("[data-part=panel]")
    pose = poses[0]
    expect(panel).to_contain_text(f"MMSI {pose['vessel']['mmsi']}")
    size = [f"{pose[name]:.1f}" for name in ("length_m", "width_m", "height_m")]
    expect(panel).to_contain_text(" \u00d7 ".join(size))
    expect(panel.locator("[data-part=vessel-facts]")).to_contain_text("from its")
    expect(panel.locator("[data-part=cost]")).to_have_text(f"{pose['cost']:.3f}")
    facts = panel.locator("[data-part=image-facts]")
    expect(facts).to_contain_text(pose["image"]["captured_at"][:19].replace("T", " ") + "\u00a0UTC")


def test_the_time_on_site_stands_beside_utc(
    review: ReviewPage, run_id: int, poses: list[Pose], api: httpx2.Client
) -> None:
    """A camera with a zone of its own shows its clock too, with the zone's name."""
    viewport = api.get(f"/viewports/{api.get(f'/runs/{run_id}').json()['viewport_id']}").json()
    url = f"/cameras/{viewport['camera_id']}"
    camera = api.get(url)

    def set_zone(zone: str) -> None:
        version = api.get(url).headers["ETag"]
        answer = api.patch(url, json={"timezone": zone}, headers={"If-Match": version})
        assert answer.status_code == 200, answer.text

    set_zone("Asia/Tokyo")
    try:
        review.open(run_id, poses[0]["id"])
        taken = datetime.fromisoformat(poses[0]["image"]["captured_at"])
        there = taken.astimezone(ZoneInfo("Asia/Tokyo"))
        facts = review.page.locator("[data-part=image-facts]")
        expect(facts).to_contain_text(f"Local time{there:%H:%M:%S}\u00a0GMT+9")
    finally:
        set_zone(camera.json()["timezone"])


def test_the_map_shows_camera_vessel_and_track(review: ReviewPage) -> None:
    """The map needs no tiles: the view, the vessel with its way, a scale, and words for all."""
    drawn = review.page.get_by_role("img", name="Map: the vessel")
    expect(drawn).to_be_visible()
    for part in ("view", "ship", "camera", "scale"):
        expect(drawn.locator(f".place-map__{part}")).to_have_attribute("d", re.compile("^M"))
    expect(drawn.locator(".place-map__track").first).to_have_attribute("d", re.compile("L"))


def test_a_vessel_is_chosen_by_tapping_its_box(review: ReviewPage, poses: list[Pose]) -> None:
    """A tap on a dimmed box makes it the current one."""
    image_id = poses[0]["image"]["id"]
    other = next((p for p in poses[1:] if p["image"]["id"] == image_id), None)
    if other is None:
        pytest.skip("the first image has one pose only")
    review.press("z")
    at, viewer = review.geometry(), review.viewer.bounding_box()
    assert viewer is not None
    scale = at["scale"] / other["image"]["width_px"]
    box = other["detection"]
    u, v = (box["x1_px"] + box["x2_px"]) / 2, (box["y1_px"] + box["y2_px"]) / 2
    review.page.mouse.click(viewer["x"] + at["x"] + u * scale, viewer["y"] + at["y"] + v * scale)
    review.settle()
    assert review.pose_id == other["id"]
