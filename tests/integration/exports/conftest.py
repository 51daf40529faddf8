"""Runs to export, and the worker's part done in the test's own process."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.config import Settings
from app.db import Database
from app.exports import service
from app.storage import Storage
from tests.factories.runs import Harbour, make_harbour
from tests.worker_process import WorkerProcess

Make = Callable[[int], None]


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a registered viewport with three images."""
    with database.writing() as session:
        return make_harbour(session, images=3)


@pytest.fixture
def make(database: Database, settings: Settings) -> Make:
    """Give what a worker does of an export's job, without waiting for a worker."""

    def do(export_id: int) -> None:
        storage = Storage(settings.storage_url)
        stored, count = service.make_file(database, storage, export_id)
        with database.writing() as session:
            service.finish(session, export_id, stored, count)

    return do


@pytest.fixture
def worker(settings: Settings, tmp_path: Path) -> Iterator[WorkerProcess]:
    """Give a worker process."""
    with WorkerProcess(settings, tmp_path / "worker.log") as process:
        yield process
