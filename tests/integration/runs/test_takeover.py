"""Runs survive what happens to machines: a worker killed half-way, a run nobody wants any more."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.storage import Storage
from app.tables.detection import DetectionSet
from app.tables.runs import Pose, RunImage
from tests.factories.norderelbe import Published, make_norderelbe
from tests.worker_process import WorkerProcess, wait_until

IMAGES = 36
# From outside, ten seconds are promised; the clock of a busy test machine is given as much again.
TAKEOVER_WITHIN_S = 60  # the second worker has to start meanwhile


def status(client: TestClient, run_id: int) -> dict[str, object]:
    """Return how far a run is."""
    body: dict[str, object] = client.get(f"/api/v1/runs/{run_id}").json()
    return body


def started(client: TestClient, viewport_id: int, detector: str) -> int:
    """Start a run over REST."""
    answer = client.post("/api/v1/runs", json={"viewport_id": viewport_id, "detector": detector})
    assert answer.status_code == 201, answer.text
    return int(answer.json()["id"])


@pytest.mark.slow
def test_a_killed_worker_loses_no_pose_and_doubles_none(
    client: TestClient,
    database: Database,
    settings: Settings,
    start_worker: Callable[..., WorkerProcess],
    shared_dir: Path,
) -> None:
    """After `kill -9` in the middle another worker goes on, and each image has its one pose."""
    published = Published.read(shared_dir)
    viewport_id, detector = make_norderelbe(
        database, Storage(settings.storage_url), published, IMAGES
    )
    first = start_worker(QUAYMARK_IMAGES_PER_STEP="4")
    run_id = started(client, viewport_id, detector)
    wait_until(lambda: 0 < int(str(status(client, run_id)["images_done"])) < IMAGES)
    start_worker(QUAYMARK_IMAGES_PER_STEP="4")
    first.kill()
    at_kill = int(str(status(client, run_id)["images_done"]))
    assert at_kill < IMAGES
    wait_until(
        lambda: int(str(status(client, run_id)["images_done"])) > at_kill,
        within_s=TAKEOVER_WITHIN_S,
        what="the takeover",
    )
    wait_until(lambda: status(client, run_id)["status"] == "succeeded", what="the end of the run")

    with database.reading() as session:
        posed = session.scalars(sa.select(Pose.image_id).where(Pose.run_id == run_id)).all()
        done = session.scalars(
            sa.select(RunImage.image_id).where(
                RunImage.run_id == run_id, RunImage.done_at.is_not(None)
            )
        ).all()
        sets = session.scalar(sa.select(sa.func.count(DetectionSet.id)))
    assert len(posed) == len(set(posed)) == IMAGES
    assert sorted(done) == sorted(posed)
    assert sets == IMAGES


@pytest.mark.slow
def test_a_cancelled_run_stops_and_keeps_what_it_made(
    client: TestClient,
    database: Database,
    settings: Settings,
    start_worker: Callable[..., WorkerProcess],
    shared_dir: Path,
) -> None:
    """Cancelling ends a run before its last image; the poses made until then stay."""
    published = Published.read(shared_dir)
    viewport_id, detector = make_norderelbe(
        database, Storage(settings.storage_url), published, IMAGES
    )
    start_worker(QUAYMARK_IMAGES_PER_STEP="2")
    run_id = started(client, viewport_id, detector)
    wait_until(lambda: int(str(status(client, run_id)["images_done"])) > 0)
    answer = client.post(f"/api/v1/runs/{run_id}/cancel")
    assert answer.status_code == 200
    assert answer.json()["status"] == "cancelled"
    # The next run is done by the same worker only after it let go of the first.
    next_run = started(client, viewport_id, detector)
    wait_until(lambda: status(client, next_run)["status"] == "succeeded")

    cancelled = status(client, run_id)
    assert cancelled["status"] == "cancelled"
    assert 0 < int(str(cancelled["images_done"])) < IMAGES
    assert cancelled["poses"] == cancelled["images_done"]


def test_a_second_run_detects_nothing_again(
    client: TestClient,
    database: Database,
    settings: Settings,
    start_worker: Callable[..., WorkerProcess],
    shared_dir: Path,
) -> None:
    """A run with the same detector and settings takes the boxes that are known already.

    It opens neither the photographs nor the detector: both may be gone from the store by then.
    """
    published = Published.read(shared_dir)
    viewport_id, detector = make_norderelbe(database, Storage(settings.storage_url), published, 3)
    start_worker()
    run_ids = []
    for _ in range(2):
        run_ids.append(started(client, viewport_id, detector))
        wait_until(lambda: status(client, run_ids[-1])["status"] in {"succeeded", "failed"})
        shutil.rmtree(settings.storage_url, ignore_errors=True)

    assert [status(client, run_id)["images_failed"] for run_id in run_ids] == [0, 0]
    with database.reading() as session:
        sets = [
            session.scalars(
                sa.select(RunImage.detection_set_id)
                .where(RunImage.run_id == run_id)
                .order_by(RunImage.position)
            ).all()
            for run_id in run_ids
        ]
        assert session.scalar(sa.select(sa.func.count(DetectionSet.id))) == 3
    assert sets[0] == sets[1]
