"""How workers begin and end: with their parent, at a signal, replaced when they die."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.config import Settings
from app.db import Database
from app.tables.runs import RunStatus
from tests.postgres import PostgresCluster
from tests.worker.conftest import (
    MakeViewport,
    Runs,
    StartWorker,
    is_running,
    live_pids,
    send,
)
from tests.worker_process import ROOT, wait_until
from worker.main import why_unusable

PARENT = """
import os, subprocess, sys, time
subprocess.Popen([sys.executable, "-m", "worker", f"--parent-pid={os.getpid()}", *sys.argv[1:]])
time.sleep(600)
"""


def environment(settings: Settings) -> dict[str, str]:
    """Return the environment of an installation."""
    return os.environ | {
        "QUAYMARK_DATA_DIR": str(settings.data_dir),
        "QUAYMARK_DATABASE_URL": settings.database_url,
        "QUAYMARK_STORAGE_URL": settings.storage_url,
        "QUAYMARK_HEARTBEAT_S": "0.2",
    }


@contextmanager
def parent_of_worker(settings: Settings, *arguments: str) -> Iterator[int]:
    """Give the id of a process that started a worker and waits."""
    process = subprocess.Popen(
        [sys.executable, "-c", PARENT, *arguments], cwd=ROOT, env=environment(settings)
    )
    try:
        yield process.pid
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize("concurrency", [1, 2])
def test_workers_end_with_their_parent(
    settings: Settings, database: Database, concurrency: int
) -> None:
    """A parent killed without a word takes its workers along, a supervisor's children too."""
    with parent_of_worker(settings, f"--concurrency={concurrency}") as parent:
        wait_until(lambda: len(live_pids(database)) == concurrency, what="the heartbeats")
        pids = live_pids(database)
        assert all(is_running(pid) for pid in pids)
        send(parent, signal.SIGKILL)
        wait_until(lambda: not any(map(is_running, pids)), what="the end of all workers")
    assert live_pids(database) == set()


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
@pytest.mark.slow
def test_a_supervisor_replaces_the_dead_and_stops_the_living(
    settings: Settings, database: Database
) -> None:
    """A killed child has a successor beside its sibling; SIGTERM ends them all, with 0."""
    process = subprocess.Popen(
        [sys.executable, "-m", "worker", "--concurrency=2"], cwd=ROOT, env=environment(settings)
    )
    try:
        wait_until(lambda: len(live_pids(database)) == 2, what="two heartbeats")
        victim, sibling = sorted(live_pids(database))
        send(victim, signal.SIGKILL)
        wait_until(lambda: len(live_pids(database) - {victim}) == 2, what="a successor")
        successor = (live_pids(database) - {victim, sibling}).pop()
        process.terminate()
        assert process.wait(60) == 0
        assert not any(map(is_running, (sibling, successor)))
        assert live_pids(database) == {victim}
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # workers take their time
@pytest.mark.slow
def test_a_stopped_workers_run_goes_on_elsewhere(
    database: Database, start_worker: StartWorker, make_viewport: MakeViewport, runs: Runs
) -> None:
    """At SIGTERM in mid-run a worker leaves with 0 and says so: nobody waits to take over."""
    patient = {"QUAYMARK_TAKEOVER_AFTER_S": "3600", "QUAYMARK_IMAGES_PER_STEP": "1"}
    run_id = runs.start(make_viewport(60))
    first = start_worker(**patient)
    wait_until(lambda: runs.done(run_id) > 0, what="the first images")
    first.stop()
    assert first.code == 0
    assert runs.get(run_id).status is RunStatus.RUNNING
    assert live_pids(database) == set()
    start_worker(**patient)
    wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of the run")
    assert runs.done(run_id) == 60


@pytest.mark.parametrize("concurrency", [1, 2])
@pytest.mark.parametrize("kind", ["sqlite", "postgres", "nowhere"])
def test_a_database_that_does_not_fit_is_one_clear_line(
    tmp_path: Path, request: pytest.FixtureRequest, kind: str, concurrency: int
) -> None:
    """On an empty or unreachable database a worker ends with 1 and says in one line what to do."""
    if kind == "postgres":
        cluster: PostgresCluster = request.getfixturevalue("postgres_cluster")
        url = cluster.create(f"empty_{concurrency}")
    else:
        empty = f"sqlite:///{tmp_path / 'empty.db'}"
        url = empty if kind == "sqlite" else "postgresql+psycopg://nobody@127.0.0.1:1/nothing"
    settings = Settings(data_dir=tmp_path, database_url=url)
    ended = subprocess.run(
        [sys.executable, "-m", "worker", f"--concurrency={concurrency}"],
        cwd=ROOT,
        env=environment(settings),
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1, ended.stderr
    assert ("connection" if kind == "nowhere" else "quaymark db upgrade") in ended.stderr


def test_a_provider_that_is_not_installed_is_told_before_any_job(
    database: Database, settings: Settings
) -> None:
    """A worker says which provider is missing and which there are, and does not start."""
    assert why_unusable(database, settings) is None
    wanted = settings.model_copy(update={"detector_providers": ["TPUExecutionProvider"]})
    reason = why_unusable(database, wanted)
    assert reason is not None
    assert "TPUExecutionProvider is not installed here; there are" in reason
    assert "QUAYMARK_DETECTOR_PROVIDERS" in reason
