"""Work is kept: drafts, saves, two people at once, lost sessions, files, registration."""

import json
from pathlib import Path

import httpx2
import pytest
from playwright.sync_api import FilePayload, Page, expect

from app.auth.authentication import SESSION_COOKIE
from app.tables.identity import Role
from tests.browser.conftest import Complaints, Installation
from tests.browser.register_page import RegisterPage
from tests.browser.registrable import Registrable, make_registrable, true_keypoints
from tests.factories import identity

HEAD = "name,u_px,v_px,lat_deg,lon_deg,height_m,role"


@pytest.fixture
def viewport(api: httpx2.Client) -> Registrable:
    """Give a viewport on which ten of twelve landmarks are placed."""
    return make_registrable(api, 10)


@pytest.fixture
def editor(page: Page, viewport: Registrable) -> RegisterPage:
    """Give its open editor."""
    opened = RegisterPage(page)
    opened.open(viewport.viewport_id)
    return opened


def sync_text(editor: RegisterPage) -> str:
    """Return what the page says of saving."""
    return editor.page.locator("[data-part=sync-text]").inner_text()


def give_file(editor: RegisterPage, name: str, text: str) -> None:
    """Choose a file to import."""
    payload = FilePayload(name=name, mimeType="text/csv", buffer=text.encode())
    editor.page.locator("[data-part=import-chooser]").set_input_files(payload)


def test_unsaved_work_survives_a_reload(editor: RegisterPage) -> None:
    """A reload brings unsaved keypoints back, also an incomplete one; undo takes them away."""
    editor.mark("Mark 01").focus()
    editor.press("ArrowUp", "ArrowUp")
    moved = editor.pixel("Mark 01")
    editor.click_photograph(500, 400)
    editor.page.reload()
    expect(editor.page.get_by_text("Your unsaved changes are back")).to_be_visible()
    editor.wait()
    assert editor.pixel("Mark 01") == pytest.approx(moved)
    assert editor.names()[0] == "Point 1"
    editor.viewer.focus()
    editor.press("u")
    assert editor.pixel("Mark 01")[1] == pytest.approx(moved[1] + 2)


def test_a_lost_session_loses_nothing(
    editor: RegisterPage, viewport: Registrable, api: httpx2.Client, complaints: Complaints
) -> None:
    """A save without a session says so and keeps the work; signed in again, it is saved."""
    complaints.expect("401")
    cookies = editor.page.context.cookies()
    editor.page.context.clear_cookies()
    editor.mark("Mark 01").focus()
    editor.press("ArrowUp", "s")
    expect(editor.page.get_by_role("link", name="Sign in")).to_be_visible()
    editor.page.context.add_cookies([dict(cookie) for cookie in cookies])  # type: ignore[misc]
    editor.press("s")
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Saved")
    stored = api.get(f"/viewports/{viewport.viewport_id}/keypoints").json()["items"]
    found = {item["name"]: item for item in stored}["Mark 01"]
    assert found["v_px"] == pytest.approx(true_keypoints()[0]["v_px"] - 1)


def test_two_people_merge(
    editor: RegisterPage, viewport: Registrable, api: httpx2.Client, complaints: Complaints
) -> None:
    """A stale save shows what the other changed, lets one choose, and keeps both people's work."""
    complaints.expect("412")
    path = f"/viewports/{viewport.viewport_id}/keypoints"
    theirs = api.get(path)
    items = theirs.json()["items"]
    items[0]["u_px"] += 5
    items[1]["u_px"] += 7
    answer = api.put(path, json={"keypoints": items}, headers={"If-Match": theirs.headers["ETag"]})
    assert answer.status_code == 200, answer.text
    for name in ("Mark 02", "Mark 03"):
        editor.mark(name).focus()
        editor.press("ArrowDown")
    editor.press("s")
    dialog = editor.page.get_by_role("dialog", name="Somebody else saved these keypoints meanwhile")
    expect(dialog.get_by_role("listitem").filter(has_text="Mark 01")).to_contain_text("pixel")
    expect(dialog.get_by_role("group", name="Mark 02")).to_be_visible()
    dialog.get_by_role("radio", name="Theirs").check()
    dialog.get_by_role("button", name="Merge").click()
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Saved")
    stored = {item["name"]: item for item in api.get(path).json()["items"]}
    first, second, third = true_keypoints()[:3]
    assert stored["Mark 01"]["u_px"] == pytest.approx(first["u_px"] + 5)
    assert stored["Mark 02"]["u_px"] == pytest.approx(second["u_px"] + 7)
    assert stored["Mark 02"]["v_px"] == pytest.approx(second["v_px"])
    assert stored["Mark 03"]["v_px"] == pytest.approx(third["v_px"] + 1)


def test_registering_saves_and_stores_a_solution(
    editor: RegisterPage, viewport: Registrable, api: httpx2.Client
) -> None:
    """R saves what is unsaved and stores the solution that runs will use."""
    editor.mark("Mark 04").focus()
    editor.press("Shift+ArrowLeft")
    editor.rest()
    editor.press("r")
    expect(editor.page.get_by_text("Registered: leave-one-out error")).to_be_visible()
    assert sync_text(editor) == "Saved"
    found = api.get(f"/viewports/{viewport.viewport_id}/registrations").json()["items"]
    assert found[-1]["method"] == "pnp"
    assert found[-1]["mae_px"] < 0.2
    assert {item["method"] for item in found} == {"pnp", "homography_water", "homography_pca"}


def test_a_file_is_previewed_line_by_line_before_it_is_imported(editor: RegisterPage) -> None:
    """Wrong lines are named with their reason; nothing is taken before it is agreed to."""
    new, known = true_keypoints()[10], true_keypoints()[2]
    give_file(
        editor,
        "points.csv",
        f"{HEAD}\n"
        f"Mark 11,{new['u_px']},{new['v_px']},,,,check\n"
        f"Mark 03,{known['u_px'] + 1},{known['v_px']},,,,control\n"
        "Comma,812,5,640,0,53,541,9,98,43\n"
        "Swapped,10,10,9.98,53.54,44,control\n",
    )
    dialog = editor.page.get_by_role("dialog", name="Import keypoints")
    rows = dialog.locator("[data-part=import-rows] tr")
    expect(rows.nth(0)).to_contain_text("new")
    expect(rows.nth(1)).to_contain_text("changes")
    expect(rows.nth(2)).to_contain_text("need semicolons")
    expect(rows.nth(3)).to_contain_text("exchanged")
    assert "Mark 11" not in editor.names()
    dialog.get_by_role("button", name="Import the 2 good lines").click()
    editor.rest()
    assert editor.cell("Mark 11", "role").inner_text() == "check"
    assert editor.pixel("Mark 03")[0] == pytest.approx(known["u_px"] + 1, abs=0.01)
    editor.viewer.focus()
    editor.press("u")
    assert "Mark 11" not in editor.names()


def test_files_go_out_and_come_back_the_same(editor: RegisterPage, tmp_path: Path) -> None:
    """The CSV and the GeoJSON of a viewport read back as what is there."""
    page = editor.page
    for kind in ("CSV", "GeoJSON"):
        page.get_by_text("File", exact=True).click()
        with page.expect_download() as download:
            page.get_by_role("button", name=f"Download {kind}").click()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        text = path.read_text()
        if kind == "GeoJSON":
            feature = json.loads(text)["features"][0]
            assert feature["geometry"]["coordinates"][2] == pytest.approx(
                true_keypoints()[0]["height_m"]
            )
        give_file(editor, path.name, text)
        dialog = page.get_by_role("dialog", name="Import keypoints")
        expect(dialog).to_contain_text("Nothing in this file differs")
        dialog.get_by_role("button", name="Cancel").click()


def test_a_server_out_of_reach_keeps_the_work_and_the_figures(
    editor: RegisterPage, complaints: Complaints
) -> None:
    """Without the server points still move and are judged here; a save says what became of it."""
    complaints.expect("ERR_")
    editor.page.route("**/api/v1/**", lambda route: route.abort())
    editor.mark("Mark 06").focus()
    editor.press("ArrowRight", "ArrowRight", "ArrowRight")
    assert editor.number("Mark 06", "error") > 1
    editor.press("s")
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Not saved: offline")
    editor.page.unroute("**/api/v1/**")
    editor.press("s")
    expect(editor.page.locator("[data-part=sync-text]")).to_have_text("Saved")


def test_who_may_not_register_may_look(
    stranger: Page, installation: Installation, viewport: Registrable
) -> None:
    """A viewer sees points and figures, and cannot move anything."""
    with installation.database.writing() as session:
        cookie = identity.make_login_session(session, identity.make_user(session, Role.VIEWER))
    stranger.context.add_cookies(
        [{"name": SESSION_COOKIE, "value": cookie, "url": installation.url}]
    )
    editor = RegisterPage(stranger)
    editor.open(viewport.viewport_id)
    before = editor.pixel("Mark 01")
    editor.mark("Mark 01").focus()
    editor.press("ArrowUp")
    assert editor.pixel("Mark 01") == before
    expect(stranger.get_by_role("button", name="Register", exact=True)).to_have_count(0)
