"""What holds for every page: it fits the window, ships little, and the browser finds no fault."""

from collections.abc import Iterator
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from app.config import Settings
from app.main import create_app
from app.tables.imagery import Image
from app.tables.runs import Run
from tests.browser.conftest import Complaints, Installation, MakeRun
from tests.check_pages import filled, page_routes
from tests.factories.ais import table
from tests.factories.identity import make_user
from tests.factories.world import make_feed, make_import, make_turned, make_webhook

WINDOWS = ({"width": 1440, "height": 900}, {"width": 1024, "height": 768})
LIGHT_BYTES = 400_000
# Leads to another page.
NO_PAGES = {"/", "/sign-in", "/admin"}


@pytest.fixture(scope="module")
def addresses(
    installation: Installation,
    api: httpx2.Client,
    make_run: MakeRun,
    tmp_path_factory: pytest.TempPathFactory,
) -> list[str]:
    """Give every page's address, with the demo harbour's ids in it."""
    harbour = installation.harbour
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("routes")))

    def first(path: str) -> dict[str, Any]:
        found: dict[str, Any] = api.get(path).json()["items"][0]
        return found

    ids = {
        "site_id": harbour.site_id,
        "camera_id": harbour.camera_id,
        "viewport_id": harbour.viewport_ids[0],
        "image_id": first("/images")["id"],
        "file_id": first("/ais/files")["id"],
        "mmsi": first("/ais/vessels")["mmsi"],
        "model_id": first("/models")["id"],
        "run_id": make_run("Walked through"),
    }
    judged = {"run_id": ids["run_id"], "name": "Clear cases", "from_truth": True}
    ids["set_id"] = api.post("/calibration-sets", json=judged).json()["id"]
    with installation.database.writing() as session:
        run = session.get_one(Run, ids["run_id"])
        image = session.get_one(Image, ids["image_id"])
        ids |= make_turned(session, run.viewport, image, run.registration_id, "walked")
        ids |= make_import(session, run.viewport.camera, "walked")
        ids |= make_feed(session, harbour.site_id, "walked")
        ids |= make_webhook(session, harbour.site_id, "walked")
        ids["user_id"] = make_user(session).id
    asked = {"format": "ndjson", "filters": {"run_id": ids["run_id"]}}
    ids["export_id"] = api.post("/exports", json=asked).json()["id"]
    recording = {"file": ("waiting.csv", table(60))}
    sent = api.post(f"{installation.url}/ais", files=recording)
    ids["upload_id"] = int(sent.headers["location"].rpartition("/")[2])
    return [filled(path, ids) for path in page_routes(app, "GET") if path not in NO_PAGES]


def visited(page: Page, addresses: list[str]) -> Iterator[str]:
    """Open page after page, each until it is complete."""
    for address in addresses:
        answer = page.goto(address)
        assert answer is not None
        assert answer.status == 200, address
        if address.endswith("/review"):
            expect(page.locator("[data-review][data-state=loaded]")).to_be_visible()
        yield address


def test_every_page_fits_the_window_without_a_complaint(page: Page, addresses: list[str]) -> None:
    """No page is wider than usual windows, and the browser reports no error and no violation."""
    assert len(addresses) > 20
    for address in visited(page, addresses):
        for window in WINDOWS:
            page.set_viewport_size(window)
            wider = page.evaluate(
                "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
            )
            assert wider == 0, f"{address} is {wider} px too wide at {window['width']}"


def test_every_page_is_titled(page: Page, addresses: list[str]) -> None:
    """Every page has one heading of the first order and a title of its own."""
    titles = {}
    for address in visited(page, addresses):
        assert page.locator("h1").count() == 1, address
        titles[address] = page.title()
    assert all(title.endswith("Quaymark") and title != "Quaymark" for title in titles.values())


def test_every_page_ships_little(page: Page, addresses: list[str]) -> None:
    """Without photographs no page but the REST reference brings over 0.4 MB, none a stranger's."""
    for address in visited(page, addresses):
        parts: list[dict[str, Any]] = page.evaluate(
            """() => ["navigation", "resource"].flatMap((kind) =>
              performance.getEntriesByType(kind).map((part) => ({
                name: part.name, bytes: part.decodedBodySize,
              })))"""
        )
        own = [part for part in parts if "/images/" not in part["name"] or part is parts[0]]
        limit = 2 * LIGHT_BYTES if address.endswith("/docs") else LIGHT_BYTES
        assert sum(part["bytes"] for part in own) < limit, address
        origin = page.evaluate("() => location.origin")
        assert all(part["name"].startswith((origin, "data:")) for part in parts), address


def test_no_name_is_shown_as_code(page: Page, addresses: list[str]) -> None:
    """No page shows what a template forgot: None, undefined, NaN, an empty cell's braces."""
    for address in visited(page, addresses):
        if address.endswith("/docs"):
            continue  # speaks of None on purpose
        text = page.locator("main").inner_text().split()
        assert not {"None", "undefined", "NaN", "[object", "{}"} & set(text), address


def test_the_chosen_theme_stays(page: Page) -> None:
    """The switch between light and dark holds at once, on the next page and after a reload."""
    page.emulate_media(color_scheme="light")
    page.goto("/sites")
    body = page.locator("body")
    light = body.evaluate("(body) => getComputedStyle(body).backgroundColor")
    page.get_by_role("button", name="Switch between light and dark").click()
    expect(body).not_to_have_css("background-color", light)
    dark = body.evaluate("(body) => getComputedStyle(body).backgroundColor")
    page.reload()
    expect(body).to_have_css("background-color", dark)
    page.goto("/runs")
    expect(body).to_have_css("background-color", dark)
    page.get_by_role("button", name="Switch between light and dark").click()
    expect(body).to_have_css("background-color", light)


def test_a_missing_page_shows_the_way_back(page: Page, complaints: Complaints) -> None:
    """An address that leads nowhere is answered by a page with a way on."""
    complaints.expect("404")
    answer = page.goto("/runs/999999")
    assert answer is not None
    assert answer.status == 404
    expect(page.get_by_role("heading", name="Not found")).to_be_visible()
    page.get_by_role("link", name="To the start page").click()
    expect(page.get_by_role("heading", name="Home", exact=True)).to_be_visible()


def test_tab_reaches_the_content(page: Page) -> None:
    """The first Tab offers to skip to the content, and every step of Tab is visible."""
    page.goto("/runs")
    page.keyboard.press("Tab")
    skip = page.get_by_role("link", name="Skip to the content")
    expect(skip).to_be_focused()
    expect(skip).to_be_in_viewport()
    for _ in range(8):
        page.keyboard.press("Tab")
        width = page.evaluate("() => getComputedStyle(document.activeElement).outlineWidth")
        assert width != "0px", page.evaluate("() => document.activeElement.outerHTML")
