"""Matching anew: another vessel for a detection, and a box for a detection that had none."""

from collections.abc import Callable
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Complaints, MakeRun
from tests.browser.review_page import ReviewPage
from tests.worker_process import wait_until

Pose = dict[str, Any]


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give one run to all of these tests."""
    return make_run("matched anew")


@pytest.fixture(scope="module")
def poses(run_id: int, poses_of: Callable[[int], list[Pose]]) -> list[Pose]:
    """Give the poses of the run."""
    return poses_of(run_id)


def candidates_of(api: httpx2.Client, pose: Pose) -> list[dict[str, Any]]:
    """Ask the server for the vessels that a pose's detection may show."""
    found: list[dict[str, Any]] = api.get(f"/poses/{pose['id']}/candidates").json()["candidates"]
    return found


def name_of(candidate: dict[str, Any]) -> str:
    """Return what a vessel goes by on the page."""
    return str(candidate["name"] or f"MMSI {candidate['mmsi']}")


@pytest.fixture(scope="module")
def contested(api: httpx2.Client, poses: list[Pose]) -> list[Pose]:
    """Give poses whose detections may show another vessel as well."""
    return [pose for pose in poses if len(candidates_of(api, pose)) > 1]


def test_one_key_takes_another_vessel(
    page: Page, run_id: int, contested: list[Pose], api: httpx2.Client
) -> None:
    """R lists the vessels by cost and shows where each is; a digit takes one, beside the old."""
    pose = contested.pop()
    candidates = candidates_of(api, pose)
    review = ReviewPage(page)
    review.open(run_id, pose["id"])
    review.press("r")
    rows = page.locator("[data-part=candidates] .candidate strong")
    expect(rows).to_have_text([name_of(candidate) for candidate in candidates])
    assert [row["cost"] for row in candidates] == sorted(row["cost"] for row in candidates)
    expect(page.locator(".overlay-candidate")).to_have_count(len(candidates))
    other = next(index for index, row in enumerate(candidates) if not row["current"])
    expect(page.locator(f".overlay-candidate.is-chosen[data-candidate='{other}']")).to_be_attached()
    review.press(str(other + 1))
    expect(page.locator("[data-part=vessel-name]")).to_have_text(name_of(candidates[other]))
    expect(page.locator("[data-part=corrected]")).to_contain_text("Matched anew by")
    stored = api.get(f"/poses/{pose['id']}").json()
    assert stored["correction"]["kind"] == "rematched"
    assert stored["correction"]["mmsi"] == candidates[other]["mmsi"]
    assert stored["vessel"] == pose["vessel"], "the generated match stays"


def test_arrows_choose_and_a_click_takes(
    page: Page, run_id: int, contested: list[Pose], api: httpx2.Client
) -> None:
    """The arrows move through the list, Escape changes nothing, a click takes a vessel."""
    pose = contested.pop()
    candidates = candidates_of(api, pose)
    review = ReviewPage(page)
    review.open(run_id, pose["id"])
    review.press("r")
    chosen = page.locator(".candidate.is-chosen strong")
    expect(chosen).to_have_text(name_of(candidates[1 if candidates[0]["current"] else 0]))
    review.press("ArrowUp", "ArrowUp", "ArrowUp")
    expect(chosen).to_have_text(name_of(candidates[0]))
    review.press("Escape")
    expect(page.locator("[data-part=mode]")).to_be_hidden()
    assert api.get(f"/poses/{pose['id']}").json()["correction"] is None
    other = next(row for row in candidates if not row["current"])
    review.press("r")
    page.locator(".candidate", has_text=name_of(other)).first.click()
    expect(page.locator("[data-part=vessel-name]")).to_have_text(name_of(other))


def test_a_detection_without_a_box_gets_one(
    page: Page, run_id: int, poses: list[Pose], api: httpx2.Client
) -> None:
    """The panel offers detections without a box; a vessel that AIS has there makes one of it."""
    target = free_detection(api, run_id, poses)
    review = ReviewPage(page)
    review.open(run_id, target["pose_id"])
    review.press("r")
    expect(page.locator("[data-part=rematch-others]")).to_be_visible()
    page.locator("[data-part=free-detections] button").nth(target["index"]).click()
    row = page.locator(".candidate", has_text=name_of(target["candidate"])).first
    row.click()
    expect(page.locator("[data-part=mode]")).to_be_hidden()

    def made() -> bool:
        found = api.get("/poses", params={"run_id": run_id, "image_id": target["image"]}).json()
        return any(
            pose["person_made"] and pose["detection"]["id"] == target["id"]
            for pose in found["items"]
        )

    wait_until(made, what="the pose made by hand")


def test_a_match_never_replaces_what_somebody_else_just_saved(
    page: Page, run_id: int, contested: list[Pose], api: httpx2.Client, complaints: Complaints
) -> None:
    """Who picks on an older state sees the other's correction first, and then picks again."""
    complaints.expect("412")
    pose = contested.pop()
    candidates = candidates_of(api, pose)
    other = next(index for index, row in enumerate(candidates) if not row["current"])
    review = ReviewPage(page)
    review.open(run_id, pose["id"])
    review.press("r")
    expect(page.locator(".candidate")).to_have_count(len(candidates))
    box = api.get(f"/poses/{pose['id']}/edit").json()["generated"]
    theirs = {name: value for name, value in box.items() if name != "up_m"} | {"width_m": 11}
    assert api.post(f"/poses/{pose['id']}/corrections", json=theirs).status_code == 201
    review.press(str(other + 1))
    expect(page.locator(".flash")).to_contain_text("Theirs is shown")
    assert api.get(f"/poses/{pose['id']}").json()["correction"]["kind"] == "edited"
    expect(page.locator(".candidate")).to_have_count(len(candidates))
    review.press(str(other + 1))
    expect(page.locator("[data-part=vessel-name]")).to_have_text(name_of(candidates[other]))


def free_detection(api: httpx2.Client, run_id: int, poses: list[Pose]) -> dict[str, Any]:
    """Find a detection without a pose that a vessel without one may have made."""
    for pose in poses:
        image_id = pose["image"]["id"]
        asked = {"run_id": run_id, "limit": 200}
        found = api.get(f"/images/{image_id}/detections", params=asked).json()["items"]
        free = [box for box in found if box["pose_id"] is None]
        for index, box in enumerate(free):
            answer = api.get(f"/detections/{box['id']}/candidates", params={"run_id": run_id})
            for candidate in answer.json()["candidates"]:
                if candidate["pose_id"] is None:
                    return {
                        "image": image_id,
                        "pose_id": pose["id"],
                        "id": box["id"],
                        "index": index,
                        "candidate": candidate,
                    }
    pytest.skip("the harbour has no detection that could be matched by hand")
