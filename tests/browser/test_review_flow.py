"""The hand's way through a review: reasons, undo, the rest of an image, completeness, own keys."""

from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.axe import findings
from tests.browser.review_page import ReviewPage

Poses = list[dict[str, Any]]


def verdict_on(api: httpx2.Client, pose: dict[str, Any]) -> dict[str, Any] | None:
    """Ask the server for the verdict that stands for a pose."""
    verdict: dict[str, Any] | None = api.get(f"/poses/{pose['id']}").json()["review"]
    return verdict


def grades_of(api: httpx2.Client, poses: Poses) -> list[str | None]:
    """Ask the server for the grades of some poses."""
    verdicts = [verdict_on(api, pose) for pose in poses]
    return [None if verdict is None else verdict["grade"] for verdict in verdicts]


def together(poses: Poses) -> Poses:
    """Return the poses of the first image that has several."""
    for pose in poses:
        same = [other for other in poses if other["image"]["id"] == pose["image"]["id"]]
        if len(same) > 1:
            return same
    pytest.fail("no image has two poses")


def test_a_reason_goes_to_the_decision_just_made(
    review: ReviewPage, poses: Poses, api: httpx2.Client
) -> None:
    """After Bad the next pose shows and W is its reason; any other key goes on with the work."""
    review.press("3")
    chips = review.page.locator("[data-part=reasons]")
    expect(chips).to_contain_text("Bad. Why?")
    assert review.pose_id == poses[1]["id"]
    review.press("w", "q", "w")  # heading, position, and heading taken back
    review.press("1")
    assert review.pose_id == poses[2]["id"]
    expect(chips).to_be_hidden()
    review.press("q")  # Good has no reasons: the key means nothing
    review.expect_all_saved()
    first, second = verdict_on(api, poses[0]), verdict_on(api, poses[1])
    assert first is not None
    assert second is not None
    assert (first["grade"], first["reasons"]) == ("bad", ["position"])
    assert (second["grade"], second["reasons"]) == ("good", [])


def test_backspace_takes_decisions_back_one_by_one(
    review: ReviewPage, poses: Poses, api: httpx2.Client, run_id: int
) -> None:
    """Each Backspace withdraws one decision on the server too, after a reload as well."""
    review.press("1", "2", "3")
    review.expect_all_saved()
    assert grades_of(api, poses[:3]) == ["good", "ok", "bad"]
    review.press("Backspace", "Backspace")
    assert review.pose_id == poses[1]["id"]
    review.expect_graded(1)
    review.expect_all_saved()
    assert grades_of(api, poses[:3]) == ["good", None, None]
    review.open(run_id)
    assert review.pose_id == poses[1]["id"]
    review.press("Backspace")
    expect(review.page.locator("[data-part=place]")).to_contain_text("image 1 of")
    review.expect_all_saved()
    assert grades_of(api, poses[:3]) == [None, None, None]


def test_shift_and_1_call_the_rest_of_the_image_good(
    page: Page, poses: Poses, api: httpx2.Client, run_id: int
) -> None:
    """All ungraded poses of the image become Good in one decision, which is undone as one."""
    same = together(poses)
    review = ReviewPage(page)
    review.open(run_id, same[0]["id"])
    review.press("2", "Shift+Digit1")
    review.expect_all_saved()
    assert grades_of(api, same) == ["ok", *["good"] * (len(same) - 1)]
    review.press("Backspace")
    review.expect_all_saved()
    assert grades_of(api, same) == ["ok", *[None] * (len(same) - 1)]
    assert review.pose_id == same[1]["id"]


def test_complete_says_what_is_missing_first(
    page: Page, poses: Poses, api: httpx2.Client, run_id: int
) -> None:
    """Enter names the poses not graded; then it marks the image complete, and undo opens it."""
    same = together(poses)
    image = same[0]["image"]["id"]
    review = ReviewPage(page)
    review.open(run_id, same[0]["id"])

    def is_complete() -> bool:
        images = api.get(f"/runs/{run_id}/images", params={"complete": "true"}).json()["items"]
        return image in [entry["image"]["id"] for entry in images]

    review.press("Enter")
    expect(page.get_by_text("Not complete yet")).to_have_count(1)
    assert review.pose_id == same[0]["id"]
    review.press("Shift+Digit1")
    page.keyboard.press("h")
    while review.pose_id not in {pose["id"] for pose in same}:
        review.press("h")
    review.press("Enter")
    review.expect_all_saved()
    assert is_complete()
    review.press("Backspace")
    review.expect_all_saved()
    assert not is_complete()


def test_a_key_pressed_as_a_dialog_closes_counts(review: ReviewPage) -> None:
    """The field of a closed dialog keeps the focus for a frame; a quick hand's key is not lost."""
    review.press("c")
    expect(review.page.get_by_role("dialog", name="Comment on")).to_be_visible()
    review.page.evaluate(
        """() => {
          const field = document.activeElement;
          field.closest("dialog").close();
          const key = { code: "KeyB", key: "b", bubbles: true, cancelable: true };
          field.dispatchEvent(new KeyboardEvent("keydown", key));
        }"""
    )
    bookmark = review.page.get_by_role("button", name="Bookmark")
    expect(bookmark).to_have_attribute("aria-pressed", "true")
    review.press("b")
    review.expect_all_saved()


def test_a_comment_and_a_bookmark_are_one_key_away(
    review: ReviewPage, poses: Poses, api: httpx2.Client
) -> None:
    """C opens a field in which keys are text and Enter saves; B marks the pose and unmarks it."""
    page = review.page
    review.press("c")
    expect(page.get_by_role("dialog", name="Comment on")).to_be_visible()
    page.keyboard.type("1 mast, 2 cranes")
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog", name="Comment on")).to_be_hidden()
    review.press("b")
    bookmark = page.get_by_role("button", name="Bookmark")
    expect(bookmark).to_have_attribute("aria-pressed", "true")
    review.expect_all_saved()
    assert review.pose_id == poses[0]["id"]
    comments = api.get(f"/poses/{poses[0]['id']}/comments").json()["items"]
    assert [comment["text"] for comment in comments] == ["1 mast, 2 cranes"]
    review.press("c")
    dialog = page.get_by_role("dialog", name="Comment on")
    expect(dialog).to_contain_text("1 mast, 2 cranes")
    page.keyboard.press("Escape")
    expect(dialog).to_be_hidden()
    review.press("b")
    expect(bookmark).to_have_attribute("aria-pressed", "false")
    review.expect_graded(0)


def test_keys_can_be_put_elsewhere(review: ReviewPage, poses: Poses, api: httpx2.Client) -> None:
    """A command moves to another key, a taken key is refused by name, and all of it stays."""
    page = review.page
    review.press("?")
    help_page = page.get_by_role("dialog", name="Grades and keys")
    assert findings(page) == []
    help_page.get_by_role("button", name="1 : Good,").click()
    page.keyboard.press("j")
    expect(help_page).to_contain_text("J is the key of “Next box”.")
    page.keyboard.press("x")
    expect(help_page.get_by_role("button", name="X : Good,")).to_be_visible()
    page.keyboard.press("Escape")
    expect(help_page).to_be_hidden()
    review.press("1")
    assert review.pose_id == poses[0]["id"], "the old key means nothing now"
    review.press("x")
    review.expect_all_saved()
    assert grades_of(api, poses[:1]) == ["good"]
    expect(page.locator("[data-grade-button][data-grade=good]")).to_contain_text("X")
    page.evaluate("() => localStorage.clear()")  # another computer: the server has the keys
    page.reload()
    review.wait()
    expect(page.locator("[data-grade-button][data-grade=good]")).to_contain_text("X")
    review.press("x")
    review.expect_all_saved()
    assert grades_of(api, poses[:2]) == ["good", "good"]


def test_help_names_the_keys_of_every_mode(review: ReviewPage) -> None:
    """The question mark shows one table a mode, made of the keys that really work."""
    review.press("?")
    titles = review.page.locator("[data-part=keys] h4").all_text_contents()
    assert titles[:3] == ["Review", "Reasons, right after a grade", "Correcting a box"]
    rows = review.page.locator("[data-part=keys] .keys__row")
    expect(rows.filter(has_text="Undo the last decision")).to_contain_text("Backspace")


def test_the_end_says_what_to_do_next(review: ReviewPage, poses: Poses) -> None:
    """When nothing is left the page says so, leads on, and a stray key grades nothing."""
    good = review.page.locator("[data-grade-button][data-grade=good]")
    for count, _ in enumerate(poses, start=1):
        expect(good).to_be_enabled()  # a key means nothing until the next pose is there
        review.press("1")
        review.expect_graded(count)
    expect(review.page.get_by_text("All done here.")).to_be_visible()
    review.expect_graded(len(poses))
    review.press("4")
    review.expect_graded(len(poses))
    strip = review.page.locator("[data-part=strip] button")
    grades = strip.evaluate_all("(all) => all.map((one) => one.dataset.grade)")
    assert set(grades) == {"good"}
    expect(review.page.get_by_role("link", name="Choose another queue")).to_be_visible()
