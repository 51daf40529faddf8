"""A worker for tests of models, and images for tests of detections."""

from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from app.config import Settings
from app.db import Database
from app.tables.imagery import Image
from app.tables.sites import Camera
from tests.factories.imagery import NOON, make_image
from tests.factories.sites import make_camera, make_site
from tests.worker_process import WorkerProcess


@pytest.fixture
def worker(settings: Settings, tmp_path: Path) -> Iterator[WorkerProcess]:
    """Run a real worker process during the test; its log is shown when the test fails."""
    with WorkerProcess(settings, tmp_path / "worker.log") as process:
        yield process
    print(process.log.read_text())  # noqa: T201  pytest shows it when the test fails


@pytest.fixture
def camera(database: Database) -> Camera:
    """Store a camera of 64 x 48 px at a site of its own."""
    with database.writing() as session:
        return make_camera(session, make_site(session))


@pytest.fixture
def images(database: Database, camera: Camera) -> list[Image]:
    """Store three images a.jpg, b.jpg and c.jpg."""
    with database.writing() as session:
        return [
            make_image(session, camera, None, NOON + timedelta(minutes=n), file_name=f"{name}.jpg")
            for n, name in enumerate("abc")
        ]
