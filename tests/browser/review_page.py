"""The review page as its tests speak of it."""

from typing import Any

from playwright.sync_api import Page, expect

GRADE_OF_KEY = {"1": "good", "2": "ok", "3": "bad", "4": "wrong"}


class ReviewPage:
    """The open review page of a run: what a reviewer presses and sees."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.viewer = page.locator(".viewer")
        self.sync = page.locator("[data-part=sync]")

    def open(self, run_id: int, pose_id: int | None = None) -> None:
        """Open the page and wait until the poses and the photograph are there."""
        pose = "" if pose_id is None else f"?pose={pose_id}"
        self.page.goto(f"/runs/{run_id}/review{pose}")
        self.wait()

    def wait(self) -> None:
        """Wait until everything is shown at its sharpest."""
        expect(self.page.locator("[data-review][data-state=loaded]")).to_be_visible()
        self.wait_for_photograph()

    def wait_for_photograph(self) -> None:
        """Wait until the full photograph is shown and the drawings are in their places."""
        expect(self.viewer).to_have_attribute("data-sharpness", "full")
        self.settle()

    def settle(self) -> None:
        """Wait for the frame that shows what was done last."""
        self.page.evaluate(
            "() => new Promise((done) =>"
            " requestAnimationFrame(() => requestAnimationFrame(() => done())))"
        )

    def press(self, *keys: str) -> None:
        """Press keys one after the other."""
        for key in keys:
            self.page.keyboard.press(key)
        self.settle()

    @property
    def pose_id(self) -> int:
        """Return which pose is shown, as its drawing and the address say."""
        group = self.page.locator(".overlay-pose.is-current")
        return int(group.get_attribute("data-pose") or 0)

    def expect_graded(self, count: int) -> None:
        """Check the count of graded poses on the page."""
        expect(self.page.locator("[data-part=graded]")).to_contain_text(f"{count} of ")

    def expect_all_saved(self) -> None:
        """Wait until the server has every grade."""
        expect(self.sync).to_have_attribute("data-state", "idle", timeout=20_000)

    def geometry(self) -> dict[str, Any]:
        """Tell where the photograph stands within the viewer, in CSS pixels, and its scale."""
        shown: dict[str, Any] = self.page.evaluate(
            """() => {
              const viewer = document.querySelector(".viewer").getBoundingClientRect();
              const image = document.querySelector(".viewer__image");
              const box = image.getBoundingClientRect();
              return {
                x: box.left - viewer.left, y: box.top - viewer.top, scale: box.width,
                width: viewer.width, height: viewer.height,
              };
            }"""
        )
        return shown

    def drawn_points(self, selector: str) -> list[tuple[float, float]]:
        """Return the corner points of the current pose's paths that match, in CSS pixels."""
        texts: list[str] = self.page.eval_on_selector_all(
            f".overlay-pose.is-current {selector}",
            "(paths) => paths.map((path) => path.getAttribute('d'))",
        )
        numbers = [
            pair.split()
            for text in texts
            for pair in text.replace("Z", "").replace("M", "L").split("L")
            if pair
        ]
        return [(float(x), float(y)) for x, y in numbers]
