"""The ways a newcomer goes: from sites to photographs, by uploads and a run to an export."""

import json
import re
from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import FilePayload, Page, expect

from app.operation.harbour_site import DETECTOR_NAME
from tests.browser.axe import findings
from tests.browser.conftest import HARBOUR, Complaints, Installation, MakeRun
from tests.browser.review_page import ReviewPage
from tests.factories.imagery import photograph
from tests.worker_process import wait_until


@pytest.fixture
def quiet_camera(api: httpx2.Client) -> int:
    """Give a camera of its own site, without photographs."""
    place = {"lat_deg": 53.54, "lon_deg": 9.98, "height_m": 40.0}
    count = len(api.get("/sites").json()["items"])
    site = api.post("/sites", json={"name": f"Quiet dock {count}", "origin": place}).json()
    camera = {
        "site_id": site["id"],
        "name": "Shed",
        "width_px": 320,
        "height_px": 240,
        "K": [[400, 0, 159.5], [0, 400, 119.5], [0, 0, 1]],
    }
    answer = api.post("/cameras", json=camera)
    assert answer.status_code == 201, answer.text
    return int(answer.json()["id"])


def test_from_sites_to_a_photograph(page: Page, installation: Installation) -> None:
    """Sites lead to the camera with its coverage and photographs, and these to a large one."""
    page.goto("/sites")
    page.get_by_role("link", name=HARBOUR.site_name).click()
    page.get_by_role("link", name="Gable camera", exact=True).click()
    expect(page).to_have_url(re.compile(f"/cameras/{installation.harbour.camera_id}$"))
    expect(page.locator("svg.coverage .coverage__cell").first).to_be_visible()
    photographs = page.locator(".grid--images img")
    expect(photographs).to_have_count(HARBOUR.images)
    photographs.first.scroll_into_view_if_needed()
    wait_until(
        lambda: photographs.first.evaluate("(image) => image.complete && image.naturalWidth > 0"),
        what="the first preview",
    )
    page.locator(".grid--images a").first.click()
    large = page.locator(".photograph img")
    wait_until(
        lambda: large.evaluate("(image) => image.complete && image.naturalWidth >= 640"),
        what="the photograph",
    )


def test_a_photograph_is_uploaded_and_a_page_in_disguise_refused(
    page: Page, quiet_camera: int, complaints: Complaints
) -> None:
    """The photograph is stored; beside the HTML file called JPEG stands why it is not."""
    complaints.expect("415")
    page.goto(f"/cameras/{quiet_camera}")
    files: list[FilePayload] = [
        {
            "name": "dock_20260512_101500.jpg",
            "mimeType": "image/jpeg",
            "buffer": photograph(1, 320, 240),
        },
        {
            "name": "page_20260512_101501.jpg",
            "mimeType": "image/jpeg",
            "buffer": b"<!DOCTYPE html><script>window.hacked = true</script>",
        },
    ]
    page.get_by_role("button", name="Photographs").set_input_files(files)
    page.get_by_role("button", name="Upload").click()
    items = page.locator("[data-upload-list] li")
    expect(items.nth(0)).to_contain_text("Stored")
    expect(items.nth(1).locator(".field__error")).to_contain_text("JPEG")
    expect(page.locator("[data-upload-summary]")).to_contain_text("1 refused")
    page.get_by_role("link", name="Show them").click()
    expect(page.locator(".grid--images img")).to_have_count(1)
    expect(page.get_by_text("2026-05-12 10:15:00 UTC").first).to_be_visible()


def test_the_same_photograph_twice_is_one(page: Page, quiet_camera: int) -> None:
    """Uploading a photograph again says that it is here already."""
    sent: FilePayload = {
        "name": "dock_20260512_111500.jpg",
        "mimeType": "image/jpeg",
        "buffer": photograph(2, 320, 240),
    }
    for answer in ("Stored", "Already here"):
        page.goto(f"/cameras/{quiet_camera}")
        page.get_by_role("button", name="Photographs").set_input_files(sent)
        page.get_by_role("button", name="Upload").click()
        expect(page.locator("[data-upload-list] li")).to_contain_text(answer)
    page.goto(f"/cameras/{quiet_camera}")
    expect(page.locator(".grid--images img")).to_have_count(1)


def start_on_form(page: Page, name: str) -> None:
    """Start a run on the harbour's first viewport by the form."""
    page.goto("/runs/new")
    page.get_by_label("Viewport").select_option(index=0)
    page.get_by_label("Detector").select_option(DETECTOR_NAME)
    page.get_by_label("Name (optional)").fill(name)
    page.get_by_role("button", name="Start the run").click()
    expect(page.get_by_role("heading", name=name)).to_be_visible()


def test_a_run_is_started_and_watched_to_its_end(page: Page, installation: Installation) -> None:
    """A run started on the form shows that it waits, goes on and ends without a reload."""
    with installation.without_worker():
        start_on_form(page, "Watched")
        expect(page.locator("[data-run-status]")).to_contain_text("Queued")
        expect(page.locator("[data-progress=right]")).to_contain_text("Waiting for a worker")
    expect(page.locator("[data-run-status]")).to_contain_text("Succeeded", timeout=30_000)
    bar = page.locator("[data-run] progress")
    assert bar.evaluate("(bar) => bar.value === bar.max && bar.max > 1")
    page.get_by_role("link", name="Review the poses").click()
    ReviewPage(page).wait()


def test_a_run_that_waits_can_be_cancelled(page: Page, installation: Installation) -> None:
    """The button on a waiting run cancels it, and the page says so."""
    with installation.without_worker():
        start_on_form(page, "Called off")
        expect(page.locator("[data-progress=right]")).to_contain_text("Waiting for a worker")
        page.get_by_role("button", name="Cancel the run").click()
        expect(page.locator("[data-run-status]")).to_contain_text("Cancelled")


def test_a_wrong_number_is_told_beside_its_field(page: Page, complaints: Complaints) -> None:
    """The form of a new run names the field that is wrong and keeps what was typed."""
    complaints.expect("422")
    page.goto("/runs/new")
    page.get_by_label("Least score").fill("1.5")
    page.get_by_role("button", name="Start the run").click()
    field = page.get_by_label("Least score")
    expect(field).to_have_value("1.5")
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(page.locator("#field-score_threshold-error")).to_be_visible()


def test_an_export_is_made_and_downloaded(
    page: Page, make_run: MakeRun, api: httpx2.Client, tmp_path: Path
) -> None:
    """Three clicks from a run, its contents seen on the way; the file holds the poses chosen."""
    run_id = make_run("To be exported")
    review = ReviewPage(page)
    review.open(run_id)
    review.press("1", "1", "3")
    review.expect_all_saved()
    page.goto(f"/runs/{run_id}")
    page.get_by_role("link", name="Export", exact=True).click()
    page.get_by_label("Good").check()
    page.get_by_role("button", name="See what it holds").click()
    expect(page).to_have_url(re.compile(rf"preview\?run_id={run_id}&grade=good&format=coco$"))
    expect(page.get_by_role("region", name="In short")).to_contain_text("2poses")
    expect(page.get_by_role("region", name="The first poses").locator("tbody tr")).to_have_count(2)
    expect(page.locator("#curl-request")).to_contain_text("application/json")
    page.get_by_role("button", name="Make the export").click()
    page.get_by_role("link", name="Download").wait_for(timeout=60_000)  # it comes by itself
    assert findings(page) == []
    with page.expect_download() as download:
        page.get_by_role("link", name="Download").click()
    path = tmp_path / "export.json"
    download.value.save_as(path)
    coco: dict[str, Any] = json.loads(path.read_text())
    assert [category["name"] for category in coco["categories"]] == ["vessel"]
    assert len(coco["annotations"]) == 2
    images = {image["id"] for image in coco["images"]}
    poses = api.get("/poses", params={"run_id": run_id}).json()["items"]
    for annotation, pose in zip(coco["annotations"], poses, strict=False):
        box = pose["detection"]
        x, y, width, height = annotation["bbox"]
        assert annotation["image_id"] in images
        assert (x, y, x + width, y + height) == pytest.approx(
            [box[side] for side in ("x1_px", "y1_px", "x2_px", "y2_px")]
        )
