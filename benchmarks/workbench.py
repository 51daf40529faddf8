"""A whole installation to measure: its database, files, web process and worker, all real."""

import os
import socket
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from app import schema
from app.auth.access import Scope
from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.runs import service
from app.storage import Storage
from app.tables.identity import Role
from app.tables.runs import Run
from tests.factories import identity

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared"


@dataclass(frozen=True)
class Workbench:
    """An installation, served at `url` and worked for where asked."""

    settings: Settings
    database: Database
    storage: Storage
    jobs: JobClient
    token: str
    url: str
    worker_pid: int | None

    def client(self) -> httpx.Client:
        """Return a client with one keep-alive connection, signed in."""
        headers = {"Authorization": f"Bearer {self.token}"}
        return httpx.Client(base_url=self.url, headers=headers, timeout=60)

    def start_run(
        self,
        viewport_id: int,
        *,
        detector: str | None = None,
        preset: str = "paper",
        **parameters: object,
    ) -> int:
        """Start a run; returns its id."""
        with self.database.writing() as session:
            return service.start_run(
                session,
                self.jobs,
                viewport_id=viewport_id,
                detector=detector,
                preset=preset,
                parameters=parameters,
            ).id

    def run(self, run_id: int) -> Run:
        """Return a run."""
        with self.database.reading() as session:
            return service.get_run(session, run_id)

    def worker_cpu_s(self) -> float:
        """Return how long the worker has computed until now, all its threads together."""
        fields = Path(f"/proc/{self.worker_pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def finish(self, run_id: int) -> Run:
        """Wait for a run's end; returns it."""
        while (run := self.run(run_id)).status not in service.ENDED:
            time.sleep(0.05)
        assert run.error is None, run.error
        return run


@contextmanager
def workbench(*, worker: bool, database_url: str | None = None) -> Iterator[Workbench]:
    """Give a fresh installation with a web process, and with a worker where asked.

    On SQLite, or in the empty database named.
    """
    with tempfile.TemporaryDirectory() as folder:
        port = _free_port()
        environment = os.environ | {"QUAYMARK_DATA_DIR": folder, "QUAYMARK_PORT": str(port)}
        if database_url is not None:
            environment["QUAYMARK_DATABASE_URL"] = database_url
        settings = Settings(data_dir=Path(folder), port=port, database_url=database_url or "")
        database = Database(settings.database_url)
        schema.upgrade(database)
        with database.writing() as session:
            person = identity.make_user(session, Role.ADMIN, None)
            token = identity.make_token(session, person, tuple(Scope))
        commands = [[str(Path(sys.executable).with_name("quaymark")), "serve"]]
        if worker:
            commands.append([sys.executable, "-m", "worker"])
        processes = [
            subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.DEVNULL)
            for command in commands
        ]
        bench = Workbench(
            settings,
            database,
            Storage(settings.storage_url),
            JobClient(settings.database_url),
            token,
            f"http://127.0.0.1:{port}",
            processes[1].pid if worker else None,
        )
        try:
            _wait_for(bench)
            yield bench
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                process.wait()
            bench.jobs.destroy()
            database.dispose()


def _free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def _wait_for(bench: Workbench) -> None:
    for _ in range(300):
        try:
            if httpx.get(f"{bench.url}/healthz").status_code == 200:
                return
        except httpx.ConnectError:
            pass
        time.sleep(0.1)
    raise TimeoutError("the web process did not come up")


class BareCommits:
    """The yardstick of everything durable: one row, one commit, on the same SQLite, no more."""

    def __init__(self, settings: Settings) -> None:
        path = settings.database_url.removeprefix("sqlite:///")
        self._connection = sqlite3.connect(path, timeout=30, isolation_level=None)
        self._connection.execute("PRAGMA synchronous=FULL")
        self._connection.execute("CREATE TABLE IF NOT EXISTS bare_rows (grade TEXT)")

    def commit_one(self) -> None:
        """Store one row durably."""
        self._connection.execute("BEGIN IMMEDIATE")
        self._connection.execute("INSERT INTO bare_rows VALUES ('good')")
        self._connection.execute("COMMIT")

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


def taken_ms(do: Callable[[], object]) -> float:
    """Return how long something takes, ms."""
    begun = time.perf_counter()
    do()
    return (time.perf_counter() - begun) * 1000


def p95(values: Sequence[float]) -> float:
    """Return the value that 95 % do not exceed."""
    return sorted(values)[int(len(values) * 0.95)]


def show(label: str, values: Sequence[float]) -> None:
    """Print a distribution, ms."""
    median = statistics.median(values)
    print(f"{label:<44} n {len(values):>5}  median {median:7.1f} ms  p95 {p95(values):7.1f} ms")


def show_load() -> None:
    """Print how busy the machine was besides: absolute figures need a quiet one."""
    one_minute = os.getloadavg()[0]
    print(f"load of the last minute {one_minute:.1f} on {os.cpu_count()} cores; trust the ratios")
