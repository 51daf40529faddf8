"""Official models are fetched from where they are published, and checked against what is known."""

import hashlib
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import ClassVar

import pytest
from sqlalchemy import select

from app.config import Settings
from app.db import Database
from app.deletions import service as deletions
from app.detectors.releases import PINNED_SHA256, Source, pull_model
from app.errors import Conflict, Invalid, TooLarge, Unavailable
from app.jobs import JobClient
from app.storage import Storage
from app.tables.detection import Model, ModelStatus
from tests.factories.onnx_models import yolox_like

LOCAL = frozenset({"http"})


class Release(BaseHTTPRequestHandler):
    """Serves what a test put into `files` (bytes) and `redirects` (addresses)."""

    files: ClassVar[dict[str, bytes]] = {}
    redirects: ClassVar[dict[str, str]] = {}
    announced_extra: ClassVar[int] = 0

    def do_GET(self) -> None:
        """Answer a request."""
        name = self.path.removeprefix("/")
        if name in self.redirects:
            self.send_response(302)
            self.send_header("Location", self.redirects[name])
            self.end_headers()
        elif name in self.files:
            self.send_response(200)
            self.send_header("Content-Length", str(len(self.files[name]) + self.announced_extra))
            self.end_headers()
            self.wfile.write(self.files[name])
        else:
            self.send_error(404)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002  the library's name
        """Say nothing."""


@pytest.fixture
def release() -> Iterator[str]:
    """Serve a release on this machine; gives its address."""
    Release.files, Release.redirects, Release.announced_extra = {}, {}, 0
    with ThreadingHTTPServer(("127.0.0.1", 0), Release) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()


@pytest.fixture
def storage(settings: Settings) -> Storage:
    """Give the test's file store."""
    return Storage(settings.storage_url)


@pytest.fixture
def jobs(database: Database) -> Iterator[JobClient]:
    """Give the queue of jobs."""
    client = JobClient(database.url)
    yield client
    client.destroy()


def test_the_first_pull_is_recorded_and_checked_ever_after(
    release: str, database: Database, storage: Storage, jobs: JobClient
) -> None:
    """The same file again changes nothing; another under the name is refused, even once removed."""
    source = Source(release, LOCAL)
    Release.files["yolox_tiny.onnx"] = data = yolox_like()
    first = pull_model(database, storage, jobs, "yolox-tiny", source=source)
    assert first.created
    assert first.model.status is ModelStatus.PROBING
    assert first.model.sha256 == hashlib.sha256(data).hexdigest()
    assert storage.read(first.model.sha256) == data
    assert not pull_model(database, storage, jobs, "yolox-tiny", source=source).created

    with database.writing() as session:
        deletions.delete(session, "model", [first.model.id], site_id=None, label="yolox-tiny")
    Release.files["yolox_tiny.onnx"] = changed = yolox_like(class_names=["ship"])
    with pytest.raises(Conflict, match="was recorded"):
        pull_model(database, storage, jobs, "yolox-tiny", source=source)
    assert not storage.exists(hashlib.sha256(changed).hexdigest())
    with database.reading() as session:
        assert session.scalars(select(Model)).all() == []


def test_nano_is_pinned(
    release: str, database: Database, storage: Storage, jobs: JobClient
) -> None:
    """Nano's hash is known before the first pull; another file is refused at once."""
    Release.files["yolox_nano.onnx"] = yolox_like()
    with pytest.raises(Conflict, match=PINNED_SHA256["yolox-nano"]):
        pull_model(database, storage, jobs, "yolox-nano", source=Source(release, LOCAL))


def test_a_release_may_move_by_redirect(
    release: str, database: Database, storage: Storage, jobs: JobClient
) -> None:
    """A redirect to an address of an allowed scheme is followed."""
    Release.redirects["yolox_s.onnx"] = f"{release}/elsewhere"
    Release.files["elsewhere"] = yolox_like()
    assert pull_model(database, storage, jobs, "yolox-s", source=Source(release, LOCAL)).created


@pytest.mark.parametrize(
    "target", ["https://127.0.0.1/x", "ftp://127.0.0.1/x", "file:///etc/passwd"]
)
def test_a_redirect_to_another_scheme_is_refused(
    release: str, database: Database, storage: Storage, jobs: JobClient, target: str
) -> None:
    """Whatever the release says, only the allowed scheme is followed."""
    Release.redirects["yolox_s.onnx"] = target
    with pytest.raises((Invalid, Unavailable), match=r"only http|not allowed"):
        pull_model(database, storage, jobs, "yolox-s", source=Source(release, LOCAL))


def test_only_https_by_default(
    release: str, database: Database, storage: Storage, jobs: JobClient
) -> None:
    """Without a word about it, an address without TLS is refused before anything is sent."""
    with pytest.raises(Invalid, match="only https"):
        pull_model(database, storage, jobs, "yolox-s", source=Source(release))


def test_what_goes_wrong_on_the_way(
    release: str, database: Database, storage: Storage, jobs: JobClient
) -> None:
    """A missing, a cut off and a too large file, and a name that is not official, each say so."""
    source = Source(release, LOCAL)
    with pytest.raises(Unavailable, match="404"):
        pull_model(database, storage, jobs, "yolox-x", source=source)
    Release.files["yolox_x.onnx"] = yolox_like()
    with pytest.raises(TooLarge):
        pull_model(database, storage, jobs, "yolox-x", source=source, max_bytes=1000)
    Release.announced_extra = 10
    with pytest.raises(Unavailable):
        pull_model(database, storage, jobs, "yolox-x", source=source)
    with pytest.raises(Invalid, match="official are yolox-nano"):
        pull_model(database, storage, jobs, "yolov8", source=source)
