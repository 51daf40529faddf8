"""The registration editor as its tests speak of it."""

import re

from playwright.sync_api import Locator, Page, expect

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


class RegisterPage:
    """The open editor of a viewport: what an operator presses and sees."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.root = page.locator("[data-register]")
        self.viewer = page.locator("[data-part=viewer]")
        self.rows = page.locator("[data-part=table] tbody tr")

    def open(self, viewport_id: int) -> None:
        """Open the editor and wait for the photograph and the first solution."""
        self.page.goto(f"/viewports/{viewport_id}/register")
        self.wait()

    def wait(self) -> None:
        """Wait until everything is loaded and the server has answered."""
        expect(self.page.locator("[data-register][data-state=ready]")).to_be_visible()
        expect(self.viewer).to_have_attribute("data-sharpness", "full")
        self.rest()

    def rest(self) -> None:
        """Wait until the server has judged what is shown."""
        self.settle()
        self.page.wait_for_function(
            "() => { const root = document.querySelector('[data-register]');"
            " return root.dataset.solver === 'solved'; }"
        )
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

    def mark(self, name: str) -> Locator:
        """Return the mark of a keypoint on the photograph."""
        return self.page.locator(".register-point").and_(
            self.page.get_by_role("slider", name=name, exact=True)
        )

    def middle_of(self, mark: Locator) -> tuple[float, float]:
        """Return where on the page a mark's middle is, CSS pixels."""
        box = mark.locator(".register-point__shape").bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def pixel(self, name: str) -> tuple[float, float]:
        """Return the pixel (u, v) of a keypoint, as it is told to screen readers."""
        text = self.mark(name).get_attribute("aria-valuetext") or ""
        u, v = NUMBER.findall(text.replace("\u202f", "").replace("\u2212", "-"))[:2]
        return float(u), float(v)

    def to_page(self, u: float, v: float) -> tuple[float, float]:
        """Return where on the page a pixel of the photograph is shown."""
        place = self.viewer.evaluate(
            """(viewer, [u, v]) => {
              const image = viewer.querySelector('.viewer__image').getBoundingClientRect();
              const scale = image.width / viewer.querySelector('.viewer__image').offsetWidth;
              return [image.left + (u + 0.5) * scale, image.top + (v + 0.5) * scale];
            }""",
            [u, v],
        )
        return place[0], place[1]

    @property
    def scale(self) -> float:
        """CSS pixels per pixel of the photograph."""
        a, b = self.to_page(0, 0), self.to_page(100, 0)
        return (b[0] - a[0]) / 100

    def click_photograph(self, u: float, v: float) -> None:
        """Click a pixel of the photograph."""
        self.page.mouse.click(*self.to_page(u, v))
        self.settle()

    def names(self) -> list[str]:
        """Return the names in the table, from the top."""
        return [name.split(" · ")[0] for name in self.rows.locator("th").all_inner_texts()]

    def cell(self, name: str, column: str) -> Locator:
        """Return a cell of the table."""
        row = self.rows.filter(has=self.page.locator("th", has_text=name))
        return row.locator(f"[data-column={column}]")

    def number(self, name: str, column: str) -> float:
        """Return a figure of the table."""
        text = self.cell(name, column).inner_text()
        return float(text.replace("\u202f", "").replace("\u2212", "-"))

    def choose(self, name: str) -> None:
        """Choose a keypoint in the table."""
        self.cell(name, "loo").click()
        self.settle()

    def field(self, label: str) -> Locator:
        """Return a field of the keypoint's form."""
        return self.page.locator("#panel-keypoint").get_by_label(label, exact=True)

    def alert(self, text: str) -> Locator:
        """Return an error beside a field."""
        return self.page.get_by_role("alert").filter(has_text=text)

    def tab(self, name: str) -> Locator:
        """Open a tab beside the table; return its panel."""
        self.page.get_by_role("tab", name=name).click()
        return self.page.get_by_role("tabpanel", name=name)
