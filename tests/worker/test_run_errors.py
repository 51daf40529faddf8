"""What goes wrong inside a run: told by name, and no more is lost than has to be."""

from pathlib import Path

import pytest
import sqlalchemy as sa

from app.config import Settings
from app.db import Database, now
from app.runs import service
from app.schema import upgrade
from app.storage import Storage
from app.tables.detection import Model
from app.tables.imagery import Image
from app.tables.runs import Pose, RunImage, RunStatus
from tests.factories.norderelbe import Published, make_norderelbe
from tests.small_disk import fill, small_disk
from tests.worker.conftest import MakeViewport, Runs, StartWorker
from tests.worker_process import WorkerProcess, wait_until


def images(database: Database) -> list[Image]:
    """Return all images in order."""
    with database.reading() as session:
        return list(session.scalars(sa.select(Image).order_by(Image.id)))


def test_bad_images_are_told_by_name_and_stop_nothing(
    database: Database,
    settings: Settings,
    start_worker: StartWorker,
    make_viewport: MakeViewport,
    runs: Runs,
) -> None:
    """A damaged and a lost image are named with reasons, a deleted one not; others get poses."""
    viewport_id = make_viewport(6)
    damaged, lost, deleted, *_ = images(database)
    storage = Storage(settings.storage_url)
    for image, data in ((damaged, b"\xff\xd8\xff no photograph"), (lost, None)):
        path = storage.local_path(image.sha256)
        assert path is not None
        if data is None:
            path.unlink()
        else:
            path.write_bytes(data)
    run_id = runs.start(viewport_id)
    with database.writing() as session:
        session.execute(sa.update(Image).where(Image.id == deleted.id).values(deleted_at=now()))
    start_worker()
    wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of the run")
    with database.reading() as session:
        told = dict(service.image_errors(session, run_id))
        progress = service.progress(session, service.get_run(session, run_id))
        posed = session.scalar(sa.select(sa.func.count()).select_from(Pose))
    assert set(told) == {damaged.file_name, lost.file_name}
    assert "cannot be decoded" in told[damaged.file_name]
    assert "gone from the store" in told[lost.file_name]
    assert (progress.images_done, progress.images_failed, posed) == (5, 2, 3)


def test_a_missing_detector_file_fails_the_run_with_its_reason(
    database: Database,
    settings: Settings,
    start_worker: StartWorker,
    make_viewport: MakeViewport,
    runs: Runs,
) -> None:
    """The run says which detector is gone and what to do; the worker goes on with the next run."""
    viewport_id = make_viewport(2)
    storage = Storage(settings.storage_url)
    with database.reading() as session:
        model = session.scalars(sa.select(Model)).one()
    path = storage.local_path(model.sha256)
    assert path is not None
    weights = path.read_bytes()
    path.unlink()
    run_id = runs.start(viewport_id)
    start_worker()
    wait_until(runs.is_at(run_id, RunStatus.FAILED), what="the failure")
    failed = runs.get(run_id)
    assert (
        failed.error == "the file of the detector 'yolox-nano' is gone from the store; add it again"
    )
    assert failed.finished_at is not None
    storage.put(weights)
    next_run = runs.start(viewport_id)
    wait_until(runs.is_at(next_run, RunStatus.SUCCEEDED), what="the next run")


def test_a_run_cancelled_in_the_queue_is_never_begun(
    database: Database, start_worker: StartWorker, make_viewport: MakeViewport, runs: Runs
) -> None:
    """A worker that comes later passes over it and does the next run."""
    viewport_id = make_viewport(2)
    cancelled, wanted = runs.start(viewport_id), runs.start(viewport_id)
    runs.cancel(cancelled)
    start_worker()
    wait_until(runs.is_at(wanted, RunStatus.SUCCEEDED), what="the end of the wanted run")
    assert runs.get(cancelled).status is RunStatus.CANCELLED
    assert runs.get(cancelled).started_at is None
    with database.reading() as session:
        begun = sa.select(sa.func.count(RunImage.done_at)).where(RunImage.run_id == cancelled)
        assert session.scalar(begun) == 0


@pytest.mark.slow
def test_a_run_on_a_full_disk_goes_on_when_there_is_room(tmp_path: Path, shared_dir: Path) -> None:
    """When SQLite finds no room in mid-run, the run waits for it; the worker need not restart."""
    with small_disk(tmp_path / "disk", 32 << 20) as disk:
        url = f"sqlite:///{disk / 'quaymark.db'}"
        settings = Settings(
            data_dir=tmp_path, database_url=url, storage_url=str(tmp_path / "files")
        )
        database = Database(url)
        upgrade(database)
        viewport_id, _ = make_norderelbe(
            database, Storage(settings.storage_url), Published.read(shared_dir), 60
        )
        runs = Runs(database, url)
        run_id = runs.start(viewport_id)
        log = tmp_path / "worker.log"
        impatient = {"QUAYMARK_IMAGES_PER_STEP": "2", "QUAYMARK_TAKEOVER_AFTER_S": "1"}
        with WorkerProcess(settings, log, **impatient) as worker:
            wait_until(lambda: runs.done(run_id) > 0, what="the first images")
            ballast = fill(disk)
            wait_until(lambda: "full" in log.read_text(), what="the disk to be found full")
            assert runs.done(run_id) < 60
            ballast.unlink()
            wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of the run")
            assert worker.code is None
        assert runs.done(run_id) == 60
        runs.destroy()
        database.dispose()
