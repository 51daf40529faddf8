"""The drawing screen as a person sees it."""

from playwright.sync_api import Page, expect


class BoxesPage:
    """Drawing boxes in a photograph."""

    def __init__(self, page: Page, url: str, image_id: int) -> None:
        self.page = page
        self.rows = page.locator("[data-part=list] li")
        self.place = page.locator("[data-part=place]")
        self.saved = page.locator("[data-part=sync]")
        page.goto(f"{url}/images/{image_id}/boxes")
        expect(page.locator("[data-part=viewer]")).to_have_attribute("data-sharpness", "full")

    def drag(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag over the photograph, from and to shares of its viewer."""
        box = self.page.locator("[data-part=viewer]").bounding_box()
        assert box is not None
        places = [
            (box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (begin, end)
        ]
        self.page.mouse.move(*places[0])
        self.page.mouse.down()
        self.page.mouse.move(*places[1], steps=4)
        self.page.mouse.up()

    def press(self, *keys: str) -> None:
        """Press keys one after the other."""
        for key in keys:
            self.page.keyboard.press(key)

    def expect_boxes(self, *classes: str) -> None:
        """Wait until the list shows exactly these classes and all is stored."""
        expect(self.rows).to_have_count(len(classes))
        for row, name in zip(self.rows.all(), classes, strict=True):
            expect(row).to_contain_text(name)
        expect(self.saved).to_have_text("Saved")
