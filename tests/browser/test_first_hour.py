"""The first hour: from an empty installation to an exported pose, led by the first page."""

import io
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import BrowserContext, Page, expect

from app import schema
from app.auth.authentication import SESSION_COOKIE
from app.config import Settings
from app.db import Database
from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame
from app.tables.identity import Role
from tests.browser.conftest import Complaints, answers, serving
from tests.browser.review_page import ReviewPage
from tests.factories import identity
from tests.factories.norderelbe import CAPTURED_AT, MMSI, Published
from tests.worker_process import WorkerProcess, wait_until

PHOTOGRAPH = "0a4a2c7b.jpg"  # as published: neither name nor EXIF tells when it was taken
PATIENT_MS = 60_000
# Pixels where landmarks are seen, and how far away they stand, metres.
SEEN = (
    (200, 600, 900.0),
    (700, 420, 1400.0),
    (1250, 760, 500.0),
    (1500, 500, 1100.0),
    (1900, 640, 800.0),
    (2300, 380, 1800.0),
    (2400, 1500, 190.0),
    (300, 1400, 200.0),
    (1200, 1600, 170.0),
)


@pytest.fixture(scope="session")
def base_url() -> str:
    """Name addresses in full: the harbour that other tests share is not wanted here."""
    return ""


@dataclass(frozen=True)
class Empty:
    """A served installation with nothing but its first administrator."""

    url: str
    cookie: str


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Empty]:
    """Serve an empty installation with a worker."""
    settings = Settings(
        data_dir=tmp_path,
        database_url=f"sqlite:///{tmp_path / 'quaymark.db'}",
        storage_url=str(tmp_path / "files"),
    )
    database = Database(settings.database_url)
    schema.upgrade(database)
    with database.writing() as session:
        user = identity.make_user(session, Role.ADMIN)
        cookie = identity.make_login_session(session, user)
    database.dispose()
    with ExitStack() as stack:
        url = stack.enter_context(serving(settings, tmp_path / "server.log"))
        stack.enter_context(WorkerProcess(settings, tmp_path / "worker.log"))
        wait_until(lambda: answers(f"{url}/readyz"), what="a server with a worker")
        yield Empty(url, cookie)


@pytest.fixture
def newcomer(context: BrowserContext, empty: Empty, complaints: Complaints) -> Page:
    """Give the first administrator's browser."""
    complaints.expect("422")  # a photograph that does not tell its time, which is then asked for
    complaints.listen(context)
    context.add_cookies([{"name": SESSION_COOKIE, "value": empty.cookie, "url": empty.url}])
    page = context.new_page()
    page.goto(f"{empty.url}/")
    return page


class FirstPage:
    """The checklist: which step it names next, and the way there."""

    def __init__(self, page: Page, url: str) -> None:
        self._page = page
        self._url = url

    def take(self, step: str) -> None:
        """Go home, see that the step is the next one, and follow its button."""
        wait_until(lambda: self._is_next(step), what=f"the step {step!r}")
        self._page.locator("[aria-current=step] a").click()

    def _is_next(self, step: str) -> bool:
        self._page.goto(f"{self._url}/")
        return self._page.locator("[aria-current=step] strong").inner_text() == step


def keypoints(published: Published) -> bytes:
    """Return a table of keypoints as somebody measured them for the published camera."""
    K = np.array(published.camera["K"])
    intrinsics = Intrinsics(published.camera["width"], published.camera["height"], K)
    frame = EnuFrame(published.origin)
    center = np.array([0.0, 0.0, published.camera["center_height_m"]])
    R_enu = np.array(published.camera["R_cam_from_local_enu"])
    camera = Camera(intrinsics, R_enu, center)
    rays = camera.rays(np.array([seen[:2] for seen in SEEN], dtype=np.float64))
    lines = ["name,u_px,v_px,lat_deg,lon_deg,height_m"]
    for number, ((u_px, v_px, away_m), ray) in enumerate(zip(SEEN, rays, strict=True), 1):
        place = frame.geodetic(center + away_m * ray)
        lines.append(
            f"Mark {number},{u_px},{v_px},{place.lat_deg:.8f},{place.lon_deg:.8f},"
            f"{place.height_m:.3f}"
        )
    return "\n".join(lines).encode()


def recording(published: Published) -> bytes:
    """Return the published vessel's report as a table."""
    vessel = published.label["vessels"][0]
    heard_at = CAPTURED_AT - timedelta(seconds=vessel["secondsSinceLastPositionReport"])
    size = vessel["size"]
    out = io.StringIO()
    out.write("mmsi,time,lat,lon,sog,cog,heading,to_bow,to_stern,to_port,to_starboard,name\n")
    out.write(
        f"{MMSI},{heard_at:%Y-%m-%dT%H:%M:%SZ},{vessel['lat']},{vessel['long']},"
        f"{vessel['speed']},{vessel['heading']},{vessel['heading']},{size['to_bow']},"
        f"{size['to_stern']},{size['to_port']},{size['to_starboard']},FERRY\n"
    )
    return out.getvalue().encode()


def fill(page: Page, fields: dict[str, object]) -> None:
    """Fill a form's fields, by name."""
    for name, value in fields.items():
        page.locator(f"main [name='{name}']").fill(str(value))


def upload(page: Page, photograph: bytes) -> None:
    """Upload a photograph, and say when it was taken as the page asks for it."""
    page.get_by_role("button", name="Photographs").set_input_files(
        {"name": PHOTOGRAPH, "mimeType": "image/jpeg", "buffer": photograph}
    )
    page.get_by_role("button", name="Upload").click()
    page.get_by_label("Taken at").fill(f"{CAPTURED_AT:%Y-%m-%dT%H:%M:%S}")
    page.get_by_role("button", name="with this time").click()
    expect(page.locator("[data-upload-list] li")).to_contain_text("Stored", timeout=PATIENT_MS)


def test_from_nothing_to_a_graded_pose_with_a_real_photograph(
    newcomer: Page, empty: Empty, shared_dir: Path
) -> None:
    """Each step the first page names can be taken from its link, ticks itself, and leads on."""
    page, first = newcomer, FirstPage(newcomer, empty.url)
    published = Published.read(shared_dir)
    K = published.camera["K"]

    first.take("Make a site")
    origin = {"lat_deg": published.origin.lat_deg, "lon_deg": published.origin.lon_deg}
    fill(page, {"name": "Norderelbe", "origin.height_m": 0, "water_level_m": 0})
    fill(page, {f"origin.{name}": value for name, value in origin.items()})
    page.locator("main form button[type=submit]").click()

    first.take("Add a camera")
    fill(page, {"name": "Kehrwieder", "width_px": 2560, "height_px": 1920})
    fill(page, {"fx_px": K[0][0], "fy_px": K[1][1], "cx_px": K[0][2], "cy_px": K[1][2]})
    page.locator("main form button[type=submit]").click()

    first.take("Add a viewport")
    fill(page, {"name": "South"})
    page.locator("main form button[type=submit]").click()
    expect(page.get_by_role("heading", name="South")).to_be_visible(timeout=PATIENT_MS)

    first.take("Upload photographs")
    upload(page, published.photograph)

    first.take("Mark 6 landmarks")
    expect(page.locator("[data-register][data-state=ready]")).to_be_visible(timeout=PATIENT_MS)
    page.locator("[data-part=import-chooser]").set_input_files(
        {"name": "marks.csv", "mimeType": "text/csv", "buffer": keypoints(published)}
    )
    page.locator("[data-part=import-take]").click()
    page.get_by_role("button", name="Register", exact=True).click()
    expect(page.get_by_text("Registered").first).to_be_visible(timeout=PATIENT_MS)

    first.take("Import AIS")
    page.locator("main input[type=file]").first.set_input_files(
        {"name": "heard.csv", "mimeType": "text/csv", "buffer": recording(published)}
    )
    page.locator("main form button[type=submit]").first.click()
    page.get_by_role("button", name="Import", exact=True).click()

    first.take("Get a detector")
    page.locator("main input[type=file]").first.set_input_files(
        {
            "name": "yolox_nano.onnx",
            "mimeType": "application/octet-stream",
            "buffer": published.weights,
        }
    )
    page.get_by_role("button", name="Add", exact=True).click()
    expect(page.get_by_text("Ready").first).to_be_visible(timeout=PATIENT_MS)

    first.take("Start a run")
    page.get_by_role("button", name="Start the run").click()
    expect(page.locator("[data-run-status]")).to_contain_text("Succeeded", timeout=PATIENT_MS)

    page.goto(f"{empty.url}/")
    expect(page.get_by_role("link", name="Begin reviewing")).to_be_visible(timeout=PATIENT_MS)
    first.take("Grade the first pose")
    review = ReviewPage(page)
    review.wait()
    review.press("1")
    review.expect_all_saved()

    first.take("Export what is good")
    page.get_by_role("button", name="See what it holds").click()
    page.get_by_role("button", name="Make the export").click()
    wait_until(lambda: is_done(page, empty.url), what="the page without its checklist")


def is_done(page: Page, url: str) -> bool:
    """Whether the first page has nothing more to say."""
    page.goto(f"{url}/")
    return page.get_by_text("Nothing is left to review").count() == 1
