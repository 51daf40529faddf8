"""A stranger's folder in the browser: broken off, gone on with, looked at, committed, undone."""

import re
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import httpx2
import pytest
from playwright.sync_api import Page, Route, expect

from tests.browser.conftest import Complaints
from tests.factories.archives import zipped
from tests.factories.imagery import photograph

LARGE_BYTES = 3_000_000
COMMENT_BYTES = 60_000
SENT_WITHIN_MS = 30_000


@pytest.fixture
def cameras(api: httpx2.Client) -> tuple[int, int]:
    """Give two cameras of 64 x 48 px of a site of their own, in Berlin's time."""
    count = len(api.get("/sites").json()["items"])
    place = {"lat_deg": 53.54, "lon_deg": 9.98, "height_m": 40.0}
    site = api.post("/sites", json={"name": f"Card dock {count}", "origin": place}).json()
    camera = {
        "site_id": site["id"],
        "width_px": 64,
        "height_px": 48,
        "K": [[80, 0, 31.5], [0, 80, 23.5], [0, 0, 1]],
        "timezone": "Europe/Berlin",
    }
    made = [api.post("/cameras", json=camera | {"name": name}) for name in ("Left", "Right")]
    assert [answer.status_code for answer in made] == [201, 201]
    return made[0].json()["id"], made[1].json()["id"]


@pytest.fixture
def card(tmp_path: Path) -> Path:
    """Give a folder as cameras leave them: five large photographs among other things."""
    folder = tmp_path / "card"
    (folder / "DCIM").mkdir(parents=True)
    for number in range(5):
        name = f"quay_03-04-2026_10.0{number}.00.jpg"
        (folder / "DCIM" / name).write_bytes(_large(number))
    (folder / "notes.txt").write_text("Moin")
    (folder / ".DS_Store").write_text("x")
    (folder / "copy.jpg").write_bytes(_large(0))
    (folder / "cut.jpg").write_bytes(photograph(9)[:-300])
    exif = photograph(7, taken="2026:10:25 02:30:00")
    (folder / "older.zip").write_bytes(zipped({"old/IMG_1.jpg": exif}))
    return folder


def _large(number: int) -> bytes:
    """Return a photograph with comments behind its beginning, so that few fit into a request."""
    data = photograph(number)
    comment = b"\xff\xfe" + (COMMENT_BYTES + 2).to_bytes(2) + bytes(COMMENT_BYTES)
    return data[:2] + comment * (LARGE_BYTES // COMMENT_BYTES) + data[2:]


def test_a_folder_comes_in_although_the_connection_breaks(
    page: Page, cameras: tuple[int, int], card: Path, complaints: Complaints, api: httpx2.Client
) -> None:
    """Closed in the middle, the page goes on with what is missing and sends nothing twice."""
    complaints.expect("ERR_FAILED")
    taken: list[str] = []

    def cut(route: Route) -> None:
        if taken:
            route.abort()
        else:
            taken.extend(_ids(route.request.url))
            route.continue_()

    page.route("**/pack?*", cut)
    page.goto(f"/cameras/{cameras[0]}")
    page.get_by_role("link", name="Import folders and zips").click()
    page.locator("[data-import-folder]").set_input_files(card)
    lost = page.get_by_text("The connection is lost. Going on by itself.")
    expect(lost).to_be_visible(timeout=SENT_WITHIN_MS)
    address = page.url
    assert re.search(r"/imports/\d+$", address)

    page.close(run_before_unload=False)
    again = page.context.new_page()
    sent: list[str] = []
    again.on("request", lambda request: sent.extend(_ids(request.url)))
    again.goto(address)
    expect(again.get_by_text("files have not come yet")).to_be_visible()
    again.locator("[data-import-folder]").set_input_files(card)
    check = again.locator("#check")
    ready = check.get_by_role("button", name="Import 1 image")
    expect(ready).to_be_visible(timeout=SENT_WITHIN_MS)
    expect(check.locator("[data-odd=no_time] td").nth(1)).to_have_text("5")
    assert not set(sent) & set(taken)
    assert len(sent) + len(taken) == 7
    assert api.get("/images", params={"camera_id": cameras[0]}).json()["items"] == []


def test_a_batch_is_looked_at_committed_moved_and_undone(
    page: Page, cameras: tuple[int, int], card: Path, api: httpx2.Client
) -> None:
    """The names' pattern is proposed, the times shown while chosen; then all goes as one."""

    def count(camera: int) -> int:
        return len(api.get("/images", params={"camera_id": camera}).json()["items"])

    page.goto(f"/cameras/{cameras[0]}/imports")
    page.locator("[data-import-folder]").set_input_files(card)
    check = page.locator("#check")
    untimed = check.locator("[data-odd=no_time] td").nth(1)
    expect(untimed).to_have_text("5", timeout=SENT_WITHIN_MS)
    expect(check.locator("[data-odd=refused] td").nth(1)).to_have_text("2")
    expect(check.locator("[data-odd=repeated] td").nth(1)).to_have_text("1")
    expect(check.locator("[data-odd=skipped] td").nth(1)).to_have_text("1")
    expect(check.locator("[data-odd=repeated_hour]")).to_contain_text("00:30:00 UTC")
    expect(page.get_by_text("day or month first?")).to_be_visible()

    page.get_by_label("Patterns of file names").fill("%m-%d-%Y_%H.%M.%S")
    page.get_by_label("In autumn's repeated hour").select_option("later")
    expect(check.get_by_text("2026-03-04 09:00:00 UTC").first).to_be_visible()
    expect(check.locator("[data-odd=repeated_hour]")).to_contain_text("01:30:00 UTC")
    check.get_by_role("button", name="Import 6 images").click()
    expect(page.get_by_role("heading", name="Undo")).to_be_visible()
    assert count(cameras[0]) == 6

    page.get_by_label("Camera", exact=True).select_option(str(cameras[1]))
    page.get_by_role("button", name="Move 6 images").click()
    expect(page.get_by_text("For camera Right")).to_be_visible()
    assert (count(cameras[0]), count(cameras[1])) == (0, 6)
    page.get_by_role("button", name="Undo this import").click()
    expect(page.get_by_role("button", name="Restore the images")).to_be_visible()
    assert count(cameras[1]) == 0
    page.get_by_role("button", name="Restore the images").click()
    expect(page.get_by_role("button", name="Undo this import")).to_be_visible()
    assert count(cameras[1]) == 6


def _ids(url: str) -> list[str]:
    """Return the ids of the files that a request brings."""
    query = parse_qs(urlsplit(url).query)
    return query.get("files", [""])[0].split(",") if "/pack" in url else []
