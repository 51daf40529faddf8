"""Workers and sites for tests of runs."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.config import Settings
from tests.worker_process import WorkerProcess


@pytest.fixture
def start_worker(settings: Settings, tmp_path: Path) -> Iterator[Callable[..., WorkerProcess]]:
    """Give the maker of worker processes; all are ended with the test, their logs shown."""
    workers: list[WorkerProcess] = []

    def start(**environment: str) -> WorkerProcess:
        log = tmp_path / f"worker-{len(workers)}.log"
        workers.append(WorkerProcess(settings, log, **environment))
        return workers[-1]

    yield start
    for worker in workers:
        worker.stop()
        print(worker.log.read_text())  # noqa: T201  pytest shows it when the test fails
