"""The application as people meet it: a real server, a real worker and a real browser.

One installation serves all of these tests: a SQLite database with the demo harbour, put in through
the same services that `quaymark demo` uses. A test that changes something begins with something of
its own: a run, a site, a person.
"""

import os
import shutil
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import httpx2
import pytest
import sqlalchemy as sa
from playwright.sync_api import BrowserContext, ConsoleMessage, Page

from app import schema
from app.auth.authentication import SESSION_COOKIE
from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.operation import harbour_repository, harbour_site
from app.operation.harbour_site import DETECTOR_NAME, HarbourChoice
from app.storage import Storage
from app.tables.detection import ModelStatus
from app.tables.identity import Role
from app.tables.reviews import Review
from app.tables.runs import Pose
from tests.browser.review_page import ReviewPage
from tests.factories import identity
from tests.identity_provider import IdentityProvider
from tests.worker_process import ROOT, WorkerProcess, wait_until

HERE = Path(__file__).parent
ADMIN = "admin@harbour.example"
# The pictures of the documentation show the whole demo; tests make do with a smaller one.
UPDATE_SCREENSHOTS = bool(os.environ.get("QUAYMARK_UPDATE_SCREENSHOTS"))
HARBOUR = HarbourChoice() if UPDATE_SCREENSHOTS else HarbourChoice(1, 16, 640, 480)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of this folder."""
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.browser)


@dataclass(frozen=True)
class Installation:
    """A served database: where it is, what is in it, and how its worker is started."""

    url: str
    database: Database
    harbour: harbour_site.HarbourSite
    start_worker: Callable[[], WorkerProcess]
    workers: list[WorkerProcess]
    provider: IdentityProvider

    @contextmanager
    def without_worker(self) -> Iterator[None]:
        """Let work wait: the worker is gone, and another comes afterwards."""
        self.workers.pop().stop()
        try:
            yield
        finally:
            self.workers.append(self.start_worker())


@pytest.fixture(scope="session")
def installation(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Installation]:
    """Serve the demo harbour."""
    folder = tmp_path_factory.mktemp("browser")
    settings = Settings(
        data_dir=folder,
        database_url=f"sqlite:///{folder / 'quaymark.db'}",
        storage_url=str(folder / "files"),
    )
    database = Database(settings.database_url)
    schema.upgrade(database)
    with database.writing() as session:
        identity.make_user(session, Role.ADMIN, email=ADMIN)
    storage = Storage(settings.storage_url)
    harbour = harbour_site.install(database, storage, settings, HARBOUR, _say_nothing)
    jobs = JobClient(settings.database_url)
    harbour_site.add_detector(database, storage, jobs)
    jobs.destroy()

    def start_worker() -> WorkerProcess:
        return WorkerProcess(settings, folder / "worker.log")

    with (
        IdentityProvider() as provider,
        serving(settings, folder / "server.log", **_told_of(provider)) as url,
    ):
        workers = [start_worker()]
        try:
            wait_until(lambda: answers(f"{url}/readyz"), what="a server with a worker")
            wait_until(lambda: _has_detector(database), what="a detector that was tried")
            yield Installation(url, database, harbour, start_worker, workers, provider)
        finally:
            workers.pop().stop()
    database.dispose()


def _told_of(provider: IdentityProvider) -> dict[str, str]:
    told = {f"QUAYMARK_{name.upper()}": value for name, value in provider.environment().items()}
    return told | {
        "QUAYMARK_OIDC_ALLOWED_NETWORKS": '["127.0.0.0/8"]',
        "QUAYMARK_SMTP_HOST": "127.0.0.1",
        "QUAYMARK_SMTP_SENDER": "quaymark@harbour.example",
    }


def _say_nothing(_text: str, *, fleeting: bool = False) -> None:
    """Keep quiet about the rendering."""


@contextmanager
def serving(settings: Settings, log: Path, **environment: str) -> Iterator[str]:
    """Run `quaymark serve` on a free port; gives its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with log.open("wb") as target:
        process = subprocess.Popen(
            [Path(sys.executable).with_name("quaymark"), "serve", f"--port={port}"],
            cwd=ROOT,
            env=os.environ
            | {
                "QUAYMARK_DATA_DIR": str(settings.data_dir),
                "QUAYMARK_DATABASE_URL": settings.database_url,
                "QUAYMARK_STORAGE_URL": settings.storage_url,
                "QUAYMARK_PUBLIC_URL": f"http://127.0.0.1:{port}",
            }
            | environment,
            stdout=target,
            stderr=subprocess.STDOUT,
        )
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(30)


def answers(url: str) -> bool:
    """Whether an address answers 200."""
    try:
        with urllib.request.urlopen(url, timeout=2) as answer:  # noqa: S310  our own address
            return answer.status == 200
    except OSError:
        return False


def _has_detector(database: Database) -> bool:
    with database.reading() as session:
        return harbour_repository.detector_status(session, DETECTOR_NAME)[0] is ModelStatus.READY


@pytest.fixture(scope="session")
def base_url(installation: Installation) -> str:
    """Give the address that pages are named from."""
    return installation.url


@pytest.fixture(scope="session")
def browser_type_launch_args() -> dict[str, Any]:
    """Start the system's Chromium, with nothing of its own going out to the network."""
    path = shutil.which("chromium")
    if path is None:
        pytest.skip("needs chromium: `make test` installs it")
    quiet = ("background-networking", "component-update", "sync")
    return {
        "executable_path": path,
        "args": [
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            *(f"--disable-{name}" for name in quiet),
        ],
    }


@pytest.fixture(scope="session")
def browser_context_args(base_url: str) -> dict[str, Any]:
    """Give the window most people have."""
    return {"base_url": base_url, "viewport": {"width": 1440, "height": 900}}


class Complaints:
    """What the browser complains of: errors, failed loads, violations of the page's policy.

    A test that means something to fail says so with `expect`; anything else fails the test.
    """

    def __init__(self) -> None:
        self._texts: list[str] = []
        self._expected: list[str] = []

    def expect(self, part: str) -> None:
        """Let complaints with this text pass."""
        self._expected.append(part)

    def listen(self, context: BrowserContext) -> None:
        """Collect what is said on any page of a context."""
        context.on("console", self._said)
        context.on("weberror", lambda error: self._texts.append(f"uncaught: {error.error}"))

    def _said(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            self._texts.append(f"{message.page.url if message.page else '?'}: {message.text}")

    @property
    def unexpected(self) -> list[str]:
        """Return what no test asked for."""
        return [text for text in self._texts if not any(part in text for part in self._expected)]


@pytest.fixture
def complaints() -> Iterator[Complaints]:
    """Fail any test during which the browser complained."""
    heard = Complaints()
    yield heard
    assert heard.unexpected == []


@pytest.fixture
def stranger(context: BrowserContext, complaints: Complaints) -> Page:
    """Give a page of a browser that is not signed in."""
    complaints.listen(context)
    return context.new_page()


@pytest.fixture
def page(stranger: Page, installation: Installation) -> Page:
    """Give a page of an administrator's browser."""
    with installation.database.writing() as session:
        user = identity.make_user(session, Role.ADMIN)
        cookie = identity.make_login_session(session, user)
    stranger.context.add_cookies(
        [{"name": SESSION_COOKIE, "value": cookie, "url": installation.url}]
    )
    return stranger


@pytest.fixture(scope="session")
def api(installation: Installation) -> Iterator[httpx2.Client]:
    """Give a script with an administrator's token: what the server says, apart from the pages."""
    with installation.database.writing() as session:
        token = identity.make_token(session, identity.make_user(session, Role.ADMIN))
    with httpx2.Client(
        base_url=f"{installation.url}/api/v1", headers={"Authorization": f"Bearer {token}"}
    ) as client:
        yield client


class MakeRun(Protocol):
    """Runs the pipeline on the harbour's first viewport."""

    def __call__(self, name: str = "") -> int:
        """Return the id of the finished run; none of its poses is graded."""


@pytest.fixture(scope="session")
def make_run(api: httpx2.Client, installation: Installation) -> MakeRun:
    """Give the maker of runs."""

    def make(name: str = "") -> int:
        asked = {
            "viewport_id": installation.harbour.viewport_ids[0],
            "detector": DETECTOR_NAME,
            "preset": "paper",
            "name": name,
        }
        answer = api.post("/runs", json=asked)
        assert answer.status_code == 201, answer.text
        run_id = int(answer.json()["id"])
        wait_until(
            lambda: api.get(f"/runs/{run_id}").json()["status"] == "succeeded", what="the run"
        )
        with installation.database.writing() as session:
            inherited = sa.select(Pose.id).where(Pose.run_id == run_id)
            session.execute(sa.delete(Review).where(Review.pose_id.in_(inherited)))
        return run_id

    return make


@pytest.fixture(scope="session")
def poses_of(api: httpx2.Client) -> Callable[[int], list[dict[str, Any]]]:
    """Give the reader of a run's poses, in the order in which they are reviewed."""

    def read(run_id: int) -> list[dict[str, Any]]:
        poses = []
        cursor = None
        while True:
            asked = {"run_id": run_id, "limit": 100} | ({"cursor": cursor} if cursor else {})
            answer = api.get("/poses", params=asked).json()
            poses += answer["items"]
            cursor = answer["next_cursor"]
            if cursor is None:
                return poses

    return read


@pytest.fixture
def run_id(make_run: MakeRun) -> int:
    """Give a run of which nobody has graded a pose."""
    return make_run()


@pytest.fixture
def poses(run_id: int, poses_of: Callable[[int], list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """Give the run's poses in the order of review."""
    return poses_of(run_id)


@pytest.fixture
def review(page: Page, run_id: int) -> ReviewPage:
    """Give the open review page."""
    opened = ReviewPage(page)
    opened.open(run_id)
    return opened
