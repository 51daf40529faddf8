"""Jobs whose worker is gone, asleep, or killed by the job itself."""

import signal

import pytest
import sqlalchemy as sa

from app.config import Settings
from app.db import Database, now
from app.storage import Storage
from app.tables.detection import DetectionSet, Model, ModelStatus
from app.tables.operation import Takeover
from app.tables.runs import Pose, RunStatus
from tests.factories.detectors import crashing
from tests.worker.conftest import MakeViewport, Runs, StartWorker, live_pids, send
from tests.worker_process import wait_until
from worker.presence import MOST_TAKEOVERS

IMAGES = 24
IMPATIENT = {
    "QUAYMARK_HEARTBEAT_S": "0.2",
    "QUAYMARK_TAKEOVER_AFTER_S": "1",
    "QUAYMARK_IMAGES_PER_STEP": "4",
}


def posed_images(database: Database, run_id: int) -> list[int]:
    """Return the images of a run's poses, one entry a pose."""
    with database.reading() as session:
        return list(session.scalars(sa.select(Pose.image_id).where(Pose.run_id == run_id)))


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
@pytest.mark.slow
def test_a_job_that_kills_its_workers_is_given_up(
    database: Database,
    settings: Settings,
    start_worker: StartWorker,
    make_viewport: MakeViewport,
    runs: Runs,
) -> None:
    """A run that takes the process down each time fails with a reason, and the next goes well."""
    viewport_id = make_viewport(2)
    data = crashing()
    with database.writing() as session:
        session.add(
            Model(
                name="deadly",
                family="yolox",
                sha256=Storage(settings.storage_url).put(data).sha256,
                size_bytes=len(data),
                status=ModelStatus.READY,
            )
        )
    deadly = runs.start(viewport_id, "deadly")
    start_worker(**IMPATIENT, QUAYMARK_WORKER_CONCURRENCY="2")
    wait_until(runs.is_at(deadly, RunStatus.FAILED), within_s=240, what="the giving up")
    assert f"died {MOST_TAKEOVERS + 1} times" in (runs.get(deadly).error or "")
    assert runs.done(deadly) == 0
    healthy = runs.start(viewport_id)
    wait_until(runs.is_at(healthy, RunStatus.SUCCEEDED), within_s=240, what="the next run")


def test_a_job_that_gets_on_has_not_used_up_its_lives(
    database: Database, start_worker: StartWorker, make_viewport: MakeViewport, runs: Runs
) -> None:
    """Deaths count only while a job stands still, and a slow worker's own silence is no death."""
    run_id = runs.start(make_viewport(2))
    with database.writing() as session:
        workflow_id = runs.get(run_id).workflow_id
        session.add(Takeover(workflow_id=workflow_id, attempts=MOST_TAKEOVERS, last_at=now()))
    # Its own last heartbeat is always older than this.
    start_worker(QUAYMARK_HEARTBEAT_S="0.1", QUAYMARK_TAKEOVER_AFTER_S="0.000001")
    wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of the run")
    with database.reading() as session:
        assert session.scalars(sa.select(Takeover)).all() == []


def suspend(database: Database, pid: int) -> None:
    """Stop a process at any moment, but not as SQLite's only writer: no other could go on."""
    if database.is_sqlite:
        with database.writing() as session:
            session.connection()
            send(pid, signal.SIGSTOP)
    else:
        send(pid, signal.SIGSTOP)


@pytest.mark.slow
def test_a_worker_that_sleeps_is_replaced_and_does_no_harm_when_it_wakes(
    database: Database, start_worker: StartWorker, make_viewport: MakeViewport, runs: Runs
) -> None:
    """A suspended worker's run goes on elsewhere; awake again it adds, fails and breaks nothing."""
    viewport_id = make_viewport(IMAGES)
    run_id = runs.start(viewport_id)
    start_worker(**IMPATIENT)
    wait_until(lambda: runs.done(run_id) > 0, what="the first images")
    (sleeper,) = live_pids(database)
    suspend(database, sleeper)
    done_at_sleep = runs.done(run_id)
    other = start_worker(**IMPATIENT)
    wait_until(lambda: runs.done(run_id) > done_at_sleep, what="the takeover")
    send(sleeper, signal.SIGCONT)
    wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of the run")
    posed = posed_images(database, run_id)
    assert len(posed) == len(set(posed)) == IMAGES
    # The sleeper takes jobs again: it does the next run alone.
    other.stop()
    next_run = runs.start(viewport_id)
    wait_until(runs.is_at(next_run, RunStatus.SUCCEEDED), what="the sleeper's next run")
    assert live_pids(database) == {sleeper}
    assert runs.get(run_id).error is None


@pytest.mark.slow
def test_runs_side_by_side_share_their_detections(
    database: Database, start_worker: StartWorker, make_viewport: MakeViewport, runs: Runs
) -> None:
    """Two workers detecting the same images at once keep one set of boxes for each image."""
    viewport_id = make_viewport(12)
    run_ids = [runs.start(viewport_id) for _ in range(2)]
    for _ in run_ids:
        start_worker(QUAYMARK_IMAGES_PER_STEP="3")
    for run_id in run_ids:
        wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of both runs")
    for run_id in run_ids:
        posed = posed_images(database, run_id)
        assert len(posed) == len(set(posed)) == 12
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(DetectionSet)) == 12
