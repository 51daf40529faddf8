"""Where landmarks stand: typed, clicked on the map, picked by name; and what the fit says."""

import re

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.register_page import RegisterPage
from tests.browser.registrable import ORIGIN, Registrable, make_registrable, true_keypoints


@pytest.fixture
def viewport(api: httpx2.Client) -> Registrable:
    """Give a viewport on which eight of twelve landmarks are placed."""
    return make_registrable(api, 8)


@pytest.fixture
def editor(page: Page, viewport: Registrable) -> RegisterPage:
    """Give its open editor."""
    opened = RegisterPage(page)
    opened.open(viewport.viewport_id)
    return opened


def in_dms(degrees: float, letters: str) -> str:
    """Write degrees as degrees, minutes and seconds."""
    minutes, seconds = divmod(abs(degrees) * 3600, 60)
    whole, minutes = divmod(int(minutes), 60)
    return f"{whole} {minutes} {seconds:.5f} {letters[0] if degrees >= 0 else letters[1]}"


def test_a_click_and_a_typed_place_make_a_keypoint(
    editor: RegisterPage, viewport: Registrable, api: httpx2.Client
) -> None:
    """A click, degrees and minutes, a height above the water: saved as an ellipsoidal height."""
    seen = true_keypoints()[8]
    editor.click_photograph(seen["u_px"], seen["v_px"])
    assert editor.names()[0] == "Point 1"
    editor.field("Name").fill("Mole head")
    editor.field("Latitude").fill("53 75 10 N")
    editor.field("Longitude").fill(in_dms(seen["lon_deg"], "EW"))
    editor.field("Longitude").press("Enter")
    expect(editor.alert("75 minutes are too many")).to_be_visible()
    editor.field("Latitude").fill(in_dms(seen["lat_deg"], "NS"))
    editor.field("Height (m)").fill(f"{seen['height_m'] - 39.6:.3f}".replace(".", ","))
    editor.field("Height (m)").press("Enter")
    expect(editor.page.locator("[data-part=height-note]")).to_contain_text(
        f"{seen['height_m']:.2f} m above the ellipsoid"
    )
    editor.rest()
    assert editor.number("Mole head", "loo") < 3
    editor.press("Escape", "Escape", "s")
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Saved")
    stored = api.get(f"/viewports/{viewport.viewport_id}/keypoints").json()["items"]
    found = {item["name"]: item for item in stored}["Mole head"]
    assert len(stored) == 9
    assert found["lat_deg"] == pytest.approx(seen["lat_deg"], abs=1e-8)
    assert found["lon_deg"] == pytest.approx(seen["lon_deg"], abs=1e-8)
    assert found["height_m"] == pytest.approx(seen["height_m"], abs=1e-3)


def test_exchanged_coordinates_are_named_and_put_right(editor: RegisterPage) -> None:
    """Latitude for longitude is said at the field, with the button that exchanges them."""
    seen = true_keypoints()[8]
    editor.click_photograph(seen["u_px"], seen["v_px"])
    editor.field("Latitude").fill(str(seen["lon_deg"]))
    editor.field("Longitude").fill(str(seen["lat_deg"]))
    editor.field("Height (m)").fill("5")
    editor.field("Height (m)").press("Enter")
    expect(editor.alert("seem exchanged")).to_be_visible()
    editor.page.get_by_role("button", name="Exchange latitude and longitude").click()
    editor.settle()
    assert editor.number("Point 1", "lat") == pytest.approx(seen["lat_deg"], abs=1e-6)
    expect(editor.alert("exchanged")).to_be_hidden()


def test_a_click_on_the_map_gives_the_waiting_keypoint_its_place(editor: RegisterPage) -> None:
    """The map says for whom it waits, and a click there stands at the water's height."""
    editor.click_photograph(400, 300)
    banner = editor.page.locator("[data-part=map-banner]")
    expect(banner).to_have_text("Click where Point 1 stands.")
    box = editor.page.locator("[data-part=map]").bounding_box()
    assert box is not None
    editor.page.mouse.click(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.4)
    editor.settle()
    expect(banner).to_be_hidden()
    assert editor.number("Point 1", "height") == pytest.approx(39.6, abs=0.01)
    assert abs(editor.number("Point 1", "lat") - ORIGIN.lat_deg) < 0.05


def test_a_landmark_is_searched_by_name_and_then_clicked(editor: RegisterPage) -> None:
    """G, a part of the name, Enter, a click: the landmark is placed where it was clicked."""
    seen = true_keypoints()[9]
    editor.press("g")
    editor.page.keyboard.type("mark 10")
    editor.press("Enter")
    expect(editor.page.locator("[data-part=banner]")).to_contain_text("Click where you see Mark 10")
    editor.click_photograph(seen["u_px"], seen["v_px"])
    editor.rest()
    assert editor.number("Mark 10", "height") == pytest.approx(seen["height_m"], abs=0.01)
    assert editor.number("Mark 10", "loo") < 3


def test_a_waiting_pixel_takes_a_landmark_by_its_name(editor: RegisterPage) -> None:
    """The other way round: click first, then type the name of a known landmark."""
    seen = true_keypoints()[10]
    editor.click_photograph(seen["u_px"], seen["v_px"])
    editor.field("Name").fill("Mark 11")
    editor.field("Name").press("Enter")
    editor.rest()
    assert editor.pixel("Mark 11") == pytest.approx((seen["u_px"], seen["v_px"]), abs=1)
    assert editor.number("Mark 11", "lat") == pytest.approx(seen["lat_deg"], abs=1e-6)


def test_a_projected_landmark_never_enters_the_fit_by_itself(editor: RegisterPage) -> None:
    """Grey landmarks are where the fit sees them; taken as drafts they stay off until placed."""
    candidate = editor.page.get_by_role("button", name=re.compile("^Mark 12: projected here"))
    expect(candidate).to_have_count(1)
    expect(editor.tab("Readiness")).to_contain_text("8 control keypoints")
    candidate.dispatch_event("click")
    editor.rest()
    assert editor.cell("Mark 12", "role").inner_text() == "off"
    expect(editor.tab("Readiness")).to_contain_text("8 control keypoints")
    seen = true_keypoints()[11]
    assert editor.pixel("Mark 12") == pytest.approx((seen["u_px"], seen["v_px"]), abs=2)
    editor.mark("Mark 12").focus()
    editor.press("1")
    editor.rest()
    expect(editor.tab("Readiness")).to_contain_text("9 control keypoints")
    editor.viewer.focus()
    editor.press("a")
    editor.rest()
    assert len(editor.names()) == 10


def test_methods_stand_side_by_side_and_the_best_leads(editor: RegisterPage) -> None:
    """PnP and both homographies, each with its errors; the least leave-one-out error leads."""
    panel = editor.tab("Methods")
    rows = panel.locator("[data-part=method-rows] tr")
    expect(rows).to_have_count(3)
    expect(rows.filter(has_text="leads")).to_have_count(1)
    expect(rows.filter(has_text="leads")).to_contain_text("PnP")
    expect(panel.locator("[data-part=method-points] tr")).to_have_count(8)
    expect(panel.locator("[data-part=camera-facts]")).to_contain_text("m above the water")


def test_layers_show_arrows_horizon_grid_and_heat(editor: RegisterPage) -> None:
    """Each overlay is drawn, and goes when it is switched off; arrows grow with their scale."""
    page = editor.page
    editor.mark("Mark 02").focus()
    editor.press("ArrowRight", "ArrowRight")
    editor.rest()
    page.get_by_role("button", name="Layers").click()
    arrows = page.locator(".register-arrow").first
    lengths = []
    for scale in ("1", "10", "50"):
        page.locator(f"input[name=arrows][value='{scale}']").check()
        editor.settle()
        box = arrows.bounding_box()
        lengths.append(0 if box is None else box["width"])
    assert lengths[0] < lengths[1] < lengths[2]
    for layer, drawn in (
        ("Horizon", ".register-horizon"),
        ("Water grid with ranges", ".register-grid"),
    ):
        expect(page.locator(drawn)).to_have_attribute("d", re.compile("M.*L"))
        page.get_by_label(layer).uncheck()
        expect(page.locator(drawn)).to_have_attribute("d", "")
    expect(page.locator(".register-heat rect")).to_have_count(0)
    page.get_by_label("Uncertainty on the water").check()
    expect(page.get_by_text("± px on the water")).to_be_visible()
    expect(page.locator(".register-heat rect").nth(50)).to_be_attached()


def test_six_keypoints_are_asked_for_before_there_is_a_solution(
    page: Page, api: httpx2.Client
) -> None:
    """Without enough keypoints nothing is solved, and what is missing is said in words."""
    editor = RegisterPage(page)
    editor.open(make_registrable(api, 0).viewport_id)
    expect(page.get_by_text("No keypoints yet")).to_be_visible()
    expect(page.locator("[data-part=headline]")).to_have_text("Needs keypoints")
    expect(page.get_by_role("button", name="Register", exact=True)).to_be_disabled()
    for seen in true_keypoints()[:6]:
        editor.press("g")
        page.keyboard.type(seen["name"])
        editor.press("Enter")
        editor.click_photograph(seen["u_px"], seen["v_px"])
        editor.press("Escape")
    editor.rest()
    expect(page.locator("[data-part=figure]")).to_contain_text("px leave-one-out")
    expect(page.get_by_role("button", name="Register", exact=True)).to_be_enabled()


def test_photograph_and_map_share_the_room_by_a_splitter(editor: RegisterPage) -> None:
    """The bar between them moves by hand and by arrows, and the place is remembered."""
    bar = editor.page.get_by_role("separator", name="Width of the photograph")
    before = editor.viewer.bounding_box()
    box = bar.bounding_box()
    assert before is not None
    assert box is not None
    editor.page.mouse.move(box["x"] + 4, box["y"] + 100)
    editor.page.mouse.down()
    editor.page.mouse.move(box["x"] - 196, box["y"] + 100)
    editor.page.mouse.up()
    after = editor.viewer.bounding_box()
    assert after is not None
    assert after["width"] == pytest.approx(box["x"] - 196 - before["x"], abs=3)
    editor.press("ArrowRight")
    wider = editor.viewer.bounding_box()
    assert wider is not None
    assert wider["width"] > after["width"] + 10
    editor.page.reload()
    editor.wait()
    again = editor.viewer.bounding_box()
    assert again is not None
    assert again["width"] == pytest.approx(wider["width"], abs=1)
