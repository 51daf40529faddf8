"""Real worker processes on both databases."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
import sqlalchemy as sa

from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.runs import service
from app.storage import Storage
from app.tables.operation import WorkerHeartbeat
from app.tables.runs import Run, RunImage, RunStatus
from tests.factories.norderelbe import Published, make_norderelbe
from tests.integration.conftest import (
    database,
    database_url,
    postgres_cluster,
    reused_database,
    settings,
    sqlite_template,
)
from tests.integration.runs.conftest import start_worker
from tests.worker_process import WorkerProcess, wait_until

__all__ = [
    "database",
    "database_url",
    "postgres_cluster",
    "reused_database",
    "settings",
    "sqlite_template",
    "start_worker",
]

StartWorker = Callable[..., WorkerProcess]
MakeViewport = Callable[[int], int]


def live_pids(database: Database) -> set[int]:
    """Return the process ids of the workers that said they live and did not say good-bye."""
    with database.reading() as session:
        return set(session.scalars(sa.select(WorkerHeartbeat.pid)))


def is_running(pid: int) -> bool:
    """Whether a process runs; one that ended and was not buried yet does not."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def send(pid: int, number: int) -> None:
    """Send a process a signal; a stop is waited for, since each thread heeds it in its own time."""
    os.kill(pid, number)
    if number == signal.SIGSTOP:
        wait_until(lambda: is_stopped(pid), what="the stop of every thread")


def is_stopped(pid: int) -> bool:
    """Tell whether every thread of a process is stopped (`proc(5)`: state T after the name)."""
    threads = Path(f"/proc/{pid}/task").glob("*/stat")
    return all(stat.read_text().rpartition(")")[2].split()[0] == "T" for stat in threads)


class Runs:
    """Starts and watches runs as the web does."""

    def __init__(self, database: Database, url: str) -> None:
        self._database = database
        self._jobs = JobClient(url)

    def start(self, viewport_id: int, detector: str = "yolox-nano", **parameters: object) -> int:
        """Start a run; returns its id."""
        with self._database.writing() as session:
            return service.start_run(
                session,
                self._jobs,
                viewport_id=viewport_id,
                detector=detector,
                preset="paper",
                parameters=parameters,
            ).id

    def cancel(self, run_id: int) -> None:
        """Cancel a run."""
        run = self.get(run_id)
        self._jobs.cancel(run.workflow_id)
        with self._database.writing() as session:
            service.mark_cancelled(session, run)

    def get(self, run_id: int) -> Run:
        """Return a run."""
        with self._database.reading() as session:
            return service.get_run(session, run_id)

    def done(self, run_id: int) -> int:
        """Return how many images of a run are done."""
        with self._database.reading() as session:
            statement = sa.select(sa.func.count(RunImage.done_at)).where(RunImage.run_id == run_id)
            return session.scalar(statement) or 0

    def is_at(self, run_id: int, status: RunStatus) -> Callable[[], bool]:
        """Return the question whether a run stands somewhere."""
        return lambda: self.get(run_id).status is status

    def destroy(self) -> None:
        """Close all connections."""
        self._jobs.destroy()


@pytest.fixture
def runs(database: Database, settings: Settings) -> Runs:
    """Give what starts and watches runs."""
    return Runs(database, settings.database_url)


@pytest.fixture
def make_viewport(
    database: Database,
    settings: Settings,
    shared_dir: Path,
) -> MakeViewport:
    """Give the maker of the published viewport with so many copies of its photograph."""
    published = Published.read(shared_dir)

    def make(images: int) -> int:
        storage = Storage(settings.storage_url)
        return make_norderelbe(database, storage, published, images)[0]

    return make
