"""Correcting a box: keys, handles and touch move it live, and the generated one is never lost."""

from collections.abc import Callable
from math import hypot
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import Complaints, MakeRun
from tests.browser.review_page import ReviewPage
from tests.worker_process import wait_until

Pose = dict[str, Any]
Point = tuple[float, float]
DRAFT = ".overlay-draft .overlay-line.layer-box"


class Editor:
    """The review page in edit mode, with the pose that is edited."""

    def __init__(self, review: ReviewPage, api: httpx2.Client, pose: Pose) -> None:
        self.review, self.page, self.api, self.pose = review, review.page, api, pose

    def enter(self) -> None:
        """Press E and wait for the box to edit."""
        self.review.press("e")
        expect(self.handle("move")).to_be_visible()

    def handle(self, name: str) -> Locator:
        """Find a handle of the box."""
        return self.page.locator(f"[data-handle={name}]")

    def value(self, name: str) -> float:
        """Read a figure of the panel, in metres or degrees."""
        text = self.page.locator(f"[data-part=edit-{name}] [data-part=value]").inner_text()
        return float(text.replace("\u00a0m", "").replace("°", ""))

    def change(self, name: str) -> str:
        """Read the change against the generated box."""
        return str(self.page.locator(f"[data-part=edit-{name}] [data-part=change]").inner_text())

    def place(self, name: str) -> Point:
        """Return the middle of a handle on the page."""
        self.review.settle()
        box = self.handle(name).bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, name: str, dx: float, dy: float) -> None:
        """Drag a handle with the mouse."""
        x, y = self.place(name)
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + dx, y + dy, steps=4)
        self.page.mouse.up()
        self.review.settle()

    def save(self) -> dict[str, Any]:
        """Press Enter; gives the correction that the server has then."""
        version = self.stored()["correction_version"]
        self.page.keyboard.press("Enter")
        expect(self.page.locator("[data-review]")).to_have_attribute("data-mode", "review")
        wait_until(lambda: self.stored()["correction_version"] > version, what="the correction")
        correction: dict[str, Any] = self.stored()["correction"]
        return correction

    def stored(self) -> Pose:
        """Ask the server for the pose."""
        pose: Pose = self.api.get(f"/poses/{self.pose['id']}").json()
        return pose

    def shift_in_screen_px(self, corners: list[list[float]]) -> float:
        """Tell how far the drawn corners lie from where these pixels stand on the screen."""
        self.review.settle()
        at = self.review.geometry()
        scale = at["scale"] / self.pose["image"]["width_px"]
        expected = [(at["x"] + (u + 0.5) * scale, at["y"] + (v + 0.5) * scale) for u, v in corners]
        texts = self.page.eval_on_selector_all(
            ".overlay-pose.is-current .overlay-line.layer-box:not(.is-bow)",
            "(paths) => paths.map((path) => path.getAttribute('d'))",
        )
        pairs = [pair.split() for text in texts for pair in text.replace("M", "L").split("L")[1:]]
        drawn = [(float(x), float(y)) for x, y in pairs]
        return max(min(hypot(x - a, y - b) for a, b in expected) for x, y in drawn) / scale


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give one run to all: each test takes a pose of its own."""
    return make_run("corrections")


@pytest.fixture(scope="module")
def unused(run_id: int, poses_of: Callable[[int], list[Pose]]) -> list[Pose]:
    """Give the poses that no test has taken yet: wholly inside their images."""
    return [pose for pose in poses_of(run_id) if pose["flags"] == []]


@pytest.fixture
def editor(page: Page, run_id: int, unused: list[Pose], api: httpx2.Client) -> Editor:
    """Give the review page at a pose that nobody has corrected."""
    review = ReviewPage(page)
    pose = unused.pop()
    review.open(run_id, pose["id"])
    return Editor(review, api, pose)


def test_keys_change_each_value_and_the_server_agrees(editor: Editor) -> None:
    """Each key changes its value by its step; what is saved is drawn where the server has it."""
    generated = editor.pose
    editor.enter()
    keys = ["ArrowRight", "ArrowRight", "ArrowUp", "w", "Shift+W", "s", "g", "c", "Shift+X"]
    editor.review.press(*keys)
    assert (editor.value("across"), editor.change("across")) == (2.0, "to the right")
    assert (editor.value("away"), editor.change("away")) == (1.0, "farther")
    assert editor.change("heading_deg") == "+1.1°"
    assert editor.value("length_m") == pytest.approx(generated["length_m"] + 1, abs=0.051)
    assert editor.change("height_m") == "+0.9\u00a0m"
    correction = editor.save()
    assert correction["width_m"] == pytest.approx(generated["width_m"] + 1, abs=1e-6)
    stored = editor.stored()
    same = ("heading_deg", "length_m", "position", "corners_in_image_px")
    assert all(stored[name] == generated[name] for name in same), "the generated pose stays"
    assert editor.shift_in_screen_px(correction["corners_in_image_px"]) < 0.1
    expect(editor.page.locator("[data-part=corrected]")).to_contain_text("Corrected by")
    ghost = editor.page.locator(".is-current .overlay-line.layer-generated")
    expect(ghost).to_be_visible()


def test_no_key_of_the_review_works_while_editing(editor: Editor) -> None:
    """A digit grades nothing while the banner names edit mode; Escape leaves without a trace."""
    editor.enter()
    expect(editor.page.locator("[data-part=mode]")).to_contain_text("Editing the box")
    editor.review.press("1", "j", "f")
    assert editor.review.pose_id == editor.pose["id"]
    assert editor.change("heading_deg").endswith("180.0°")
    editor.review.press("Escape")
    expect(editor.page.locator("[data-part=mode]")).to_be_hidden()
    editor.review.expect_all_saved()
    stored = editor.stored()
    assert stored["review"] is None
    assert stored["correction_version"] == 0


def test_handles_follow_the_mouse(editor: Editor) -> None:
    """The top raises the box, its side widens it, the box itself moves, the bow's leader turns."""
    editor.enter()
    height, heading = editor.value("height_m"), editor.value("heading_deg")
    editor.drag("top", 0, -30)
    assert editor.value("height_m") > height
    before = editor.place("move")
    editor.drag("move", 40, 0)
    after = editor.place("move")
    assert after[0] - before[0] == pytest.approx(40, abs=6)
    assert editor.value("across") > 0
    editor.drag("turn", 0, 24)
    assert editor.value("heading_deg") != heading
    length = editor.value("length_m")
    bow, stern = editor.place("bow"), editor.place("stern")
    outward = 1 if bow[0] > stern[0] else -1
    editor.drag("bow", 30 * outward, 0)
    assert editor.value("length_m") > length
    editor.review.press("Escape")


def test_a_handle_is_a_slider_for_the_keyboard(editor: Editor) -> None:
    """Each handle has a name and a value in words, and the arrows change it while focused."""
    editor.enter()
    height = editor.page.get_by_role("slider", name="Height")
    before = float(height.get_attribute("aria-valuenow") or "nan")
    height.focus()
    editor.page.keyboard.press("ArrowUp")
    editor.page.keyboard.press("Shift+ArrowUp")
    now = float(height.get_attribute("aria-valuenow") or "nan")
    assert now == pytest.approx(before + 1.1, abs=0.051)
    assert height.get_attribute("aria-valuetext") == f"{now:.1f} m"
    assert (editor.value("across"), editor.value("away")) == (0, 0), "it did not move as well"
    editor.review.press("Escape")


def test_a_finger_moves_the_box(editor: Editor) -> None:
    """A finger on the box carries it over the water."""
    editor.enter()
    session = editor.page.context.new_cdp_session(editor.page)
    x, y = editor.place("move")

    def touch(kind: str, *points: Point) -> None:
        at = [{"x": px, "y": py} for px, py in points]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

    touch("touchStart", (x, y))
    touch("touchMove", (x + 20, y + 1))
    touch("touchMove", (x + 45, y + 1))
    touch("touchEnd")
    editor.review.settle()
    assert editor.value("across") > 0.5
    editor.review.press("Escape")


def test_a_correction_can_be_taken_back(editor: Editor) -> None:
    """Reset shows the generated box again, and the server no longer counts the correction."""
    editor.enter()
    editor.review.press("c")
    editor.save()
    editor.enter()
    editor.page.get_by_role("button", name="Reset to generated").click()
    expect(editor.page.locator("[data-part=corrected]")).to_be_hidden()
    wait_until(lambda: editor.stored()["correction"] is None, what="the correction to be gone")


def test_two_corrections_are_merged_by_hand(editor: Editor, complaints: Complaints) -> None:
    """Who saves second sees what the other changed, and takes each value from one of the two."""
    complaints.expect("412")
    editor.enter()
    editor.review.press("s", "s", "w", "w", "w")
    view = editor.api.get(f"/poses/{editor.pose['id']}/edit").json()
    theirs = {name: value for name, value in view["generated"].items() if name != "up_m"}
    theirs |= {"width_m": theirs["width_m"] + 3, "heading_deg": theirs["heading_deg"] + 9}
    answer = editor.api.post(f"/poses/{editor.pose['id']}/corrections", json=theirs)
    assert answer.status_code == 201, answer.text
    editor.page.keyboard.press("Enter")
    dialog = editor.page.locator("#edit-conflict")
    expect(dialog).to_contain_text("saved another correction")
    expect(dialog.locator("legend")).to_have_text(["Heading", "Length", "Width"])
    dialog.get_by_role("group", name="Width").get_by_label("Theirs").check()
    dialog.get_by_role("button", name="Save as chosen").click()
    wait_until(lambda: editor.stored()["correction_version"] == 2, what="the merged box")
    merged = editor.stored()["correction"]
    assert merged["width_m"] == pytest.approx(theirs["width_m"])
    assert merged["length_m"] == pytest.approx(view["generated"]["length_m"] + 2)
    assert merged["heading_deg"] == pytest.approx((view["generated"]["heading_deg"] + 3) % 360)


def test_changes_outlive_a_lost_session(editor: Editor, complaints: Complaints) -> None:
    """Signed out or reloaded before saving, the changes are back, and are stored once."""
    complaints.expect("401")
    editor.enter()
    editor.review.press("c", "c")
    cookies = editor.page.context.cookies()
    editor.page.context.clear_cookies()
    editor.page.keyboard.press("Enter")
    expect(editor.page.locator(".flash")).to_contain_text("Your changes are kept")
    editor.page.context.add_cookies(cookies)  # type: ignore[arg-type]  # what it gave itself
    editor.page.reload()
    editor.review.wait()
    editor.enter()
    assert editor.change("height_m") == "+2.0\u00a0m"
    correction = editor.save()
    assert correction["version"] == 1
