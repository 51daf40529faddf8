"""Reviewing: one key a grade, and no grade is ever lost."""

from collections.abc import Callable
from typing import Any

import httpx2
import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Complaints
from tests.browser.review_page import GRADE_OF_KEY, ReviewPage
from tests.worker_process import wait_until

Poses = list[dict[str, Any]]


@pytest.fixture
def poses(run_id: int, poses_of: Callable[[int], Poses]) -> Poses:
    """Give the run's poses in the order of review."""
    found = poses_of(run_id)
    assert len(found) >= 6
    return found


def grade_of(api: httpx2.Client, pose_id: int) -> str | None:
    """Ask the server for a pose's grade."""
    review = api.get(f"/poses/{pose_id}").json()["review"]
    return None if review is None else str(review["grade"])


def test_one_key_grades_and_moves_on(
    review: ReviewPage, poses: Poses, api: httpx2.Client, run_id: int
) -> None:
    """Each of the keys 1 to 4 stores its grade by itself, and the next ungraded pose comes."""
    for (key, _), pose in zip(GRADE_OF_KEY.items(), poses, strict=False):
        assert review.pose_id == pose["id"]
        review.press(key)
    assert review.pose_id == poses[4]["id"]
    review.expect_graded(4)
    review.expect_all_saved()
    stored = [grade_of(api, pose["id"]) for pose in poses]
    assert stored == [*GRADE_OF_KEY.values(), *[None] * (len(poses) - 4)]
    review.open(run_id)
    assert review.pose_id == poses[4]["id"]
    review.expect_graded(4)


def test_a_reload_shows_the_grade_where_it_was_given(
    review: ReviewPage, poses: Poses, run_id: int
) -> None:
    """After a reload a graded pose shows its grade, also on its button."""
    review.press("3")
    review.expect_all_saved()
    review.open(run_id, poses[0]["id"])
    expect(review.page.locator("[data-part=grade]")).to_contain_text("Bad")
    pressed = review.page.locator("[data-grade-button][aria-pressed=true]")
    expect(pressed).to_have_attribute("data-grade", "bad")


def test_a_button_grades_like_its_key(review: ReviewPage, poses: Poses, api: httpx2.Client) -> None:
    """A click on a grade stores it and moves on, for those without a keyboard at hand."""
    review.page.get_by_role("button", name="Wrong match").click()
    review.expect_all_saved()
    assert grade_of(api, poses[0]["id"]) == "wrong"
    assert review.pose_id == poses[1]["id"]


def test_keys_lead_through_boxes_and_images(review: ReviewPage, poses: Poses) -> None:
    """J and K step through boxes, L and H through images, N to the next that is not graded."""
    ids = [pose["id"] for pose in poses]
    first_image = poses[0]["image"]["id"]
    of_next_image = next(pose["id"] for pose in poses if pose["image"]["id"] != first_image)
    review.press("j", "j", "k")
    assert review.pose_id == ids[1]
    review.press("k", "k", "k")
    assert review.pose_id == ids[0], "K stays at the first box"
    review.press("l")
    assert review.pose_id == of_next_image
    review.press("h")
    assert review.pose_id == ids[0]
    review.press("1")
    review.press("k", "n")
    assert review.pose_id == ids[1]


def test_the_strip_reopens_a_decision(review: ReviewPage, poses: Poses, api: httpx2.Client) -> None:
    """The last decisions stand in the strip, newest first; each leads back, to be graded again."""
    review.press("1", "2")
    strip = review.page.locator("[data-part=strip] button")
    assert strip.evaluate_all("(all) => all.map((one) => one.dataset.grade)") == ["ok", "good"]
    strip.last.click()
    assert review.pose_id == poses[0]["id"]
    review.press("4")
    assert review.pose_id == poses[2]["id"]
    review.expect_graded(2)
    review.expect_all_saved()
    assert [grade_of(api, pose["id"]) for pose in poses[:2]] == ["wrong", "ok"]


def test_holding_space_shows_the_photograph_alone(review: ReviewPage) -> None:
    """The drawings are gone while Space is down and back when it is let go."""
    overlay = review.page.locator(".viewer__overlay")
    review.page.keyboard.down("Space")
    expect(overlay).to_have_css("visibility", "hidden")
    review.page.keyboard.up("Space")
    expect(overlay).to_have_css("visibility", "visible")


def test_keys_typed_into_a_field_grade_nothing(
    review: ReviewPage, poses: Poses, api: httpx2.Client
) -> None:
    """While one types into a field, digits and letters are text and nothing else."""
    review.page.evaluate(
        "() => document.querySelector('[data-part=panel]')"
        ".append(Object.assign(document.createElement('input'), {id: 'typing'}))"
    )
    field = review.page.locator("#typing")
    field.focus()
    review.page.keyboard.type("1 jn 4")
    expect(field).to_have_value("1 jn 4")
    assert review.pose_id == poses[0]["id"]
    review.expect_graded(0)
    assert [grade_of(api, pose["id"]) for pose in poses[:2]] == [None, None]


def test_chords_belong_to_the_browser(review: ReviewPage, poses: Poses) -> None:
    """A digit with Ctrl, Alt or Shift grades nothing."""
    review.press("Control+1", "Alt+2", "Shift+3")
    assert review.pose_id == poses[0]["id"]
    review.expect_graded(0)


def test_layers_can_be_taken_away(review: ReviewPage) -> None:
    """V opens the layers, and a layer that is switched off is not drawn."""
    box = review.page.locator(".overlay-pose.is-current .overlay-line.layer-box").first
    expect(box).to_be_visible()
    review.press("v")
    review.page.get_by_label("3D box").uncheck()
    expect(box).to_be_hidden()


def test_help_explains_grades_and_keys(review: ReviewPage) -> None:
    """The question mark opens the guideline and the keys; keys rest until it is closed."""
    review.press("?")
    dialog = review.page.get_by_role("dialog", name="Grades and keys")
    expect(dialog).to_be_visible()
    review.press("1")
    review.expect_graded(0)
    review.press("Escape")
    expect(dialog).to_be_hidden()


def test_a_grade_given_without_network_arrives_later(
    review: ReviewPage, poses: Poses, api: httpx2.Client, complaints: Complaints
) -> None:
    """Grades wait while the network is cut, the page says so, and they go out when it is back."""
    complaints.expect("ERR_INTERNET_DISCONNECTED")
    context = review.page.context
    context.set_offline(offline=True)
    review.press("1", "2")
    expect(review.sync).to_have_attribute("data-state", "offline")
    expect(review.sync).to_contain_text("2 changes kept here")
    assert [grade_of(api, pose["id"]) for pose in poses[:2]] == [None, None]
    context.set_offline(offline=False)
    review.expect_all_saved()
    assert [grade_of(api, pose["id"]) for pose in poses[:2]] == ["good", "ok"]


def test_a_grade_survives_its_tab(
    review: ReviewPage, poses: Poses, api: httpx2.Client, complaints: Complaints, run_id: int
) -> None:
    """A grade unsent when its tab was closed goes out when the page opens again."""
    complaints.expect("ERR_INTERNET_DISCONNECTED")
    context = review.page.context
    context.set_offline(offline=True)
    review.press("3")
    expect(review.sync).to_have_attribute("data-state", "offline")
    review.page.close()
    context.set_offline(offline=False)
    assert grade_of(api, poses[0]["id"]) is None
    again = ReviewPage(context.new_page())
    again.open(run_id)
    again.expect_graded(1)
    wait_until(lambda: grade_of(api, poses[0]["id"]) == "bad", what="the grade")


def test_grades_wait_for_a_new_sign_in(
    review: ReviewPage, poses: Poses, api: httpx2.Client, complaints: Complaints
) -> None:
    """When the session has ended the grade is kept, and the page offers to sign in."""
    complaints.expect("401")
    context = review.page.context
    cookies = context.cookies()
    context.clear_cookies()
    review.press("2")
    expect(review.sync).to_have_attribute("data-state", "signed-out")
    expect(review.sync.get_by_role("link", name="Sign in")).to_be_visible()
    context.add_cookies(cookies)
    review.expect_all_saved()
    assert grade_of(api, poses[0]["id"]) == "ok"
