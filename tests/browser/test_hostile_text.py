"""Script in names, file names and comments: shown as text, never run, on any page."""

from collections.abc import Callable
from typing import Any

import httpx2
import pytest
from playwright.sync_api import FilePayload, Page, expect

from tests.browser.conftest import Installation, MakeRun
from tests.browser.review_page import ReviewPage
from tests.factories.imagery import photograph

FLAG = "quaymarkWasHere"
SCRIPT = f'"><img src=x onerror="window.{FLAG}=1"><script>window.{FLAG}=1</script>'
SHORT = f"<svg onload={FLAG}=1>"  # as long as AIS lets a name be


@pytest.fixture
def expect_text(page: Page) -> Callable[[str, str], None]:
    """Give a check: the page shows the text, and nothing of it has run."""

    def check(address: str, text: str) -> None:
        page.goto(address)
        if address.endswith("/review") or "/review?" in address:
            ReviewPage(page).wait()
        expect(page.get_by_text(text).first).to_be_visible()
        unharmed(page)

    return check


def unharmed(page: Page) -> None:
    """Check that no script of ours has run and that no element of it was made."""
    assert page.evaluate(f"() => window.{FLAG}") is None
    assert page.locator("[onerror], [onload], img[src=x]").count() == 0


def test_a_vessels_name_is_text(
    page: Page,
    api: httpx2.Client,
    make_run: MakeRun,
    poses_of: Callable[[int], list[dict[str, Any]]],
    expect_text: Callable[[str, str], None],
) -> None:
    """A vessel that calls itself a script is named so on the pages of AIS and in the review."""
    run_id = make_run()
    pose = poses_of(run_id)[0]
    mmsi, name = pose["vessel"]["mmsi"], pose["vessel"]["name"] or "NO NAME"
    last = api.get(f"/ais/vessels/{mmsi}").json()["last_seen_at"]

    def rename(to: str, time: str) -> None:
        row = f'{mmsi},{time},53.89,9.21,1,90,90,,9,9,2,2,"{to.replace(chr(34), chr(34) * 2)}",60'
        sent: FilePayload = {"name": f"{SHORT}.csv", "mimeType": "", "buffer": row.encode()}
        page.goto("/ais")
        page.get_by_label("File").set_input_files(sent)
        page.get_by_role("button", name="Send and look").click()
        expect(page.get_by_text(f"{SHORT}.csv").first).to_be_visible()
        unharmed(page)
        page.get_by_role("button", name="Import").click()
        page.get_by_role("link", name="What became of every line").click()
        expect(page.get_by_text(f"{SHORT}.csv").first).to_be_visible()
        unharmed(page)

    day = last[:10]
    rename(SHORT, f"{day}T23:50:00Z")
    try:
        expect_text("/ais", SHORT)
        expect_text(f"/ais/vessels/{mmsi}", SHORT)
        expect_text(f"/runs/{run_id}/review", SHORT)
        page.keyboard.press("1")
        expect(page.locator("[data-part=strip]")).to_contain_text(SHORT)
        unharmed(page)
    finally:
        rename(name, f"{day}T23:55:00Z")


def test_a_file_name_is_text(
    page: Page,
    api: httpx2.Client,
    installation: Installation,
    expect_text: Callable[[str, str], None],
) -> None:
    """A photograph named like a script shows its name on upload and on its own page."""
    name = f"<img src=x onerror=window.{FLAG}=1>_20200512_101500.jpg"
    site = {"name": SCRIPT, "origin": {"lat_deg": 53.5, "lon_deg": 9.9, "height_m": 40.0}}
    site_id = api.post("/sites", json=site).json()["id"]
    camera = {
        "site_id": site_id,
        "name": SCRIPT,
        "width_px": 320,
        "height_px": 240,
        "K": [[400, 0, 160], [0, 400, 120], [0, 0, 1]],
    }
    camera_id = api.post("/cameras", json=camera).json()["id"]
    page.goto(f"/cameras/{camera_id}")
    sent: FilePayload = {
        "name": name,
        "mimeType": "image/jpeg",
        "buffer": photograph(3, 320, 240),
    }
    page.get_by_role("button", name="Photographs").set_input_files(sent)
    page.get_by_role("button", name="Upload").click()
    item = page.locator("[data-upload-list] li")
    expect(item).to_contain_text(name)
    expect(item).to_contain_text("Stored")
    unharmed(page)
    image = api.get("/images", params={"camera_id": camera_id}).json()["items"][0]
    assert image["file_name"] == name
    expect_text(f"/images/{image['id']}", name)
    for address in ("/sites", f"/sites/{site_id}", f"/cameras/{camera_id}"):
        expect_text(address, SCRIPT)
    page.goto("/sites")
    heads = page.locator(".card__head")
    assert heads.evaluate_all("(all) => all.every((one) => one.scrollWidth <= one.clientWidth)")
    page.goto(f"{installation.url}/admin/audit")
    unharmed(page)


def test_a_comment_and_a_runs_name_are_text(
    page: Page,
    api: httpx2.Client,
    make_run: MakeRun,
    poses_of: Callable[[int], list[dict[str, Any]]],
    expect_text: Callable[[str, str], None],
) -> None:
    """A comment is stored as it was written and stands beside its grade; so does a run's name."""
    run_id = make_run(SCRIPT)
    pose = poses_of(run_id)[0]
    review = {"grade": "bad", "reasons": [], "comment": SCRIPT, "seconds": 1.0}
    answer = api.post(f"/poses/{pose['id']}/reviews", json=review)
    assert answer.status_code == 201, answer.text
    assert api.get(f"/poses/{pose['id']}").json()["review"]["comment"] == SCRIPT
    expect_text(f"/runs/{run_id}/review?pose={pose['id']}", SCRIPT)
    expect(page.locator("[data-part=comment]")).to_have_text(SCRIPT)
    for address in ("/runs", f"/runs/{run_id}", "/runs/new"):
        page.goto(address)
        unharmed(page)
    page.goto(f"/exports?run_id={run_id}")
    expect(page.get_by_label("Run (optional)")).to_contain_text(SCRIPT)
    unharmed(page)
