"""Keypoints on the photograph: placed, dragged, nudged, undone, judged while they move."""

import io

import httpx2
import numpy as np
import pytest
from PIL import Image as Picture
from playwright.sync_api import Page, expect

from app.templating import DASH
from tests.browser.register_page import RegisterPage
from tests.browser.registrable import Registrable, make_registrable
from tests.factories.imagery import photograph


@pytest.fixture
def viewport(api: httpx2.Client) -> Registrable:
    """Give a viewport on which eleven of twelve landmarks are placed."""
    return make_registrable(api, 11)


@pytest.fixture
def editor(page: Page, viewport: Registrable) -> RegisterPage:
    """Give its open editor."""
    opened = RegisterPage(page)
    opened.open(viewport.viewport_id)
    return opened


def test_a_drag_is_finer_than_a_pixel_and_a_tenth_with_shift(editor: RegisterPage) -> None:
    """A point follows the hand by its way divided by the zoom, with Shift by a tenth of it."""
    editor.viewer.focus()
    editor.press("Escape", "+", "+", "+", "+")
    editor.choose("Mark 03")
    u, v = editor.pixel("Mark 03")
    x, y = editor.middle_of(editor.mark("Mark 03"))
    mouse = editor.page.mouse
    mouse.move(x + 5, y + 4)  # near it is near enough
    mouse.down()
    mouse.move(x + 12, y + 4)
    mouse.move(x + 12, y - 3)
    mouse.up()
    editor.rest()
    moved = editor.pixel("Mark 03")
    assert moved == pytest.approx((u + 7 / editor.scale, v - 7 / editor.scale), abs=0.02)
    x, y = editor.middle_of(editor.mark("Mark 03"))
    mouse.move(x, y)
    mouse.down()
    editor.page.keyboard.down("Shift")
    mouse.move(x - 10, y)
    mouse.up()
    editor.page.keyboard.up("Shift")
    editor.rest()
    assert editor.pixel("Mark 03")[0] == pytest.approx(moved[0] - 1 / editor.scale, abs=0.02)


def test_arrows_move_by_a_pixel_with_shift_by_a_tenth_and_are_undone(
    editor: RegisterPage,
) -> None:
    """Arrows nudge the chosen point; U and Shift+U, or Ctrl+Z and its like, go back and forth."""
    editor.mark("Mark 05").focus()
    u, v = editor.pixel("Mark 05")
    editor.press("ArrowRight", "ArrowRight", "Shift+ArrowUp")
    assert editor.pixel("Mark 05") == pytest.approx((u + 2, v - 0.1), abs=0.011)
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Unsaved changes")
    editor.press("u")
    assert editor.pixel("Mark 05") == pytest.approx((u, v))
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Saved")
    editor.press("Shift+U")
    assert editor.pixel("Mark 05") == pytest.approx((u + 2, v - 0.1), abs=0.011)
    editor.press("Control+z")
    assert editor.pixel("Mark 05") == pytest.approx((u, v))
    editor.page.get_by_role("button", name="Redo").click()
    editor.settle()
    assert editor.pixel("Mark 05")[0] == pytest.approx(u + 2)


def test_the_camera_follows_a_drag_before_the_button_is_up(editor: RegisterPage) -> None:
    """While a point moves, residuals of all points are solved anew, by this browser alone."""
    asked: list[str] = []
    before = editor.number("Mark 01", "error")
    x, y = editor.middle_of(editor.mark("Mark 08"))
    mouse = editor.page.mouse
    mouse.move(x, y)
    mouse.down()
    editor.page.on("request", lambda request: asked.append(request.url))
    mouse.move(x + 6, y + 3, steps=3)
    editor.settle()
    assert editor.number("Mark 08", "loo") > editor.number("Mark 08", "error") > 1
    assert editor.number("Mark 01", "error") != before
    here = {name: editor.number(name, "loo") for name in editor.names()}
    assert asked == []
    mouse.up()
    editor.rest()
    judged = {name: editor.number(name, "loo") for name in editor.names()}
    if editor.cell("Mark 08", "role").inner_text() == "control":  # the server kept it in the fit
        assert judged == pytest.approx(here, abs=0.011)
    assert editor.names()[0] == "Mark 08"


def test_n_goes_to_the_next_worst(editor: RegisterPage) -> None:
    """The table stands worst first, and N walks down it."""
    for name, keys in (("Mark 02", 3), ("Mark 09", 6)):
        editor.mark(name).focus()
        editor.press(*["ArrowRight"] * keys)
    editor.rest()
    names = editor.names()
    figures = [editor.number(name, "loo") for name in names]
    assert figures == sorted(figures, reverse=True)
    editor.press("Escape", "n")
    expect(editor.mark(names[0])).to_be_focused()
    editor.press("n")
    expect(editor.mark(names[1])).to_be_focused()
    editor.page.get_by_role("button", name="Name", exact=True).click()
    editor.settle()
    assert editor.names() == sorted(names)


def test_the_loupe_shows_the_photographs_own_pixels(
    editor: RegisterPage, viewport: Registrable
) -> None:
    """At the pointer the pixels around it stand as squares of their own colours."""
    u, v = 301, 402
    editor.page.mouse.move(*editor.to_page(u, v))
    expect(editor.page.locator(".loupe")).to_be_visible()
    shown = editor.page.locator(".loupe canvas").evaluate(
        """(canvas) => {
          const side = canvas.width, step = 10 * devicePixelRatio;
          const { data } = canvas.getContext('2d').getImageData(0, 0, side, side);
          const index = (du) => Math.round(side / 2 + (du + 0.2) * step);
          const at = (du, dv) => {
            const first = 4 * (index(dv) * side + index(du));
            return [...data.slice(first, first + 3)];
          };
          return [at(3, 2), at(-4, 5), at(6, -3)];
        }"""
    )
    pixels = np.asarray(
        Picture.open(io.BytesIO(photograph(viewport.seed, 640, 480, kind="PNG"))).convert("RGB")
    )
    expected = [pixels[v + dv, u + du].tolist() for du, dv in ((3, 2), (-4, 5), (6, -3))]
    assert shown == expected
    editor.press("o")
    editor.page.mouse.move(*editor.to_page(u + 5, v))
    expect(editor.page.locator(".loupe")).to_be_hidden()


def test_values_are_typed_in_the_table_and_wrong_ones_explained(editor: RegisterPage) -> None:
    """A second click on a cell edits it; what cannot be meant is refused beside the field."""
    editor.choose("Mark 04")
    editor.cell("Mark 04", "u").click()
    field = editor.page.get_by_role("textbox", name="u of Mark 04")
    field.fill("9000")
    field.press("Enter")
    expect(editor.alert("runs from -0.5 to 639.5")).to_be_visible()
    field.fill("333,25")
    field.press("Tab")
    expect(editor.page.get_by_role("textbox", name="v of Mark 04")).to_be_focused()
    editor.press("Escape")
    assert editor.number("Mark 04", "u") == 333.25
    editor.cell("Mark 04", "lat").click()
    field = editor.page.get_by_role("textbox", name="Latitude of Mark 04")
    field.fill("53 75 10 N")
    field.press("Enter")
    expect(editor.alert("75 minutes are too many")).to_be_visible()
    field.press("Escape")
    editor.press("u")
    assert editor.number("Mark 04", "u") != 333.25


def test_roles_decide_what_enters_the_fit(editor: RegisterPage) -> None:
    """A check point only judges the fit, an off point is left out; keys 1 to 3 say which."""
    editor.mark("Mark 06").focus()
    editor.press(*["ArrowDown"] * 9)
    editor.press("2")
    editor.rest()
    assert editor.cell("Mark 06", "role").inner_text() == "check"
    assert editor.number("Mark 06", "error") == pytest.approx(9, abs=0.5)
    assert editor.cell("Mark 06", "loo").inner_text() == DASH
    assert editor.number("Mark 02", "error") < 0.5
    editor.press("3")
    editor.rest()
    assert editor.cell("Mark 06", "role").inner_text() == "off"
    panel = editor.tab("Readiness")
    expect(panel).to_contain_text("10 control keypoints")


def test_keys_are_muted_while_typing_and_listed_by_a_question_mark(editor: RegisterPage) -> None:
    """A letter typed into a field is text; ? lists the keys."""
    editor.choose("Mark 01")
    editor.field("Name").focus()
    editor.press("End", "n", "u", "3")
    expect(editor.field("Name")).to_have_value("Mark 01nu3")
    assert editor.cell("Mark 01", "role").inner_text() == "control"
    editor.press("Escape", "?")
    expect(editor.page.get_by_role("dialog", name="Keys and hints")).to_be_visible()


def test_a_keypoint_is_begun_moved_and_removed_by_keyboard_alone(editor: RegisterPage) -> None:
    """Enter on the photograph begins a point in the middle, arrows move it, Delete removes it."""
    editor.viewer.focus()
    editor.press("Enter")
    expect(editor.mark("Point 1")).to_be_focused()
    assert editor.pixel("Point 1") == pytest.approx((319.5, 239.5), abs=0.6)
    u, _ = editor.pixel("Point 1")
    editor.press("ArrowLeft")
    assert editor.pixel("Point 1")[0] == pytest.approx(u - 1)
    assert editor.names()[0] == "Point 1"
    editor.press("Delete")
    expect(editor.mark("Point 1")).to_have_count(0)
