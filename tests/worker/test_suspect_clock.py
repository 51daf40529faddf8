"""A camera whose clock is off: its run says so by itself and shows no match made by it."""

from collections.abc import Iterator

import pytest
import sqlalchemy as sa

from app.clocks import service as clocks
from app.config import Settings
from app.db import Database
from app.detectors.service import IMPORTED_FAMILY, IMPORTED_SETTINGS_SHA256
from app.jobs import JobClient
from app.runs import service
from app.runs.service import Progress
from app.tables.clock import ClockEstimate, ClockOffset, OffsetSource
from app.tables.runs import RunStatus, VesselStateRow
from tests.factories.passages import photograph_passages
from tests.factories.runs import make_harbour
from tests.worker.conftest import Runs, StartWorker
from tests.worker_process import wait_until

SLOW_S = 90.0


@pytest.fixture
def jobs(settings: Settings) -> Iterator[JobClient]:
    """Give what enqueues jobs."""
    client = JobClient(settings.database_url)
    yield client
    client.destroy()


def too_little(camera_id: int) -> ClockOffset:
    """Return a correction that is ten seconds short of what is needed."""
    return ClockOffset(camera_id=camera_id, offset_s=SLOW_S - 10, source=OffsetSource.GIVEN)


def ended(database: Database, runs: Runs, run_id: int) -> tuple[Progress, list[ClockEstimate]]:
    """Wait for a run; return its progress and what it doubts."""
    wait_until(runs.is_at(run_id, RunStatus.SUCCEEDED), what="the end of the run")
    with database.reading() as session:
        run = service.get_run(session, run_id)
        return service.progress(session, run), clocks.suspicions(session, run_id)


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # workers take their time
def test_matches_of_a_slow_clock_are_withheld_until_it_is_corrected(
    database: Database, start_worker: StartWorker, runs: Runs, jobs: JobClient
) -> None:
    """90 s are found within 1 s; corrected, the run is stale, and anew it matches; and undone."""
    with database.writing() as session:
        harbour = make_harbour(session, images=0)
        harbour.model.family = IMPORTED_FAMILY
        photograph_passages(session, harbour, SLOW_S, settings_sha256=IMPORTED_SETTINGS_SHA256)
    start_worker()
    run_id = runs.start(harbour.viewport.id, harbour.model.name)
    progress, (doubt,) = ended(database, runs, run_id)
    assert doubt.result is not None
    assert abs(doubt.result["offset_s"] - SLOW_S) < 1.0
    assert progress.poses == progress.matches == 0

    with database.writing() as session:
        applied = clocks.add_offset(session, offset := clocks.offset_of_estimate(doubt))
        run = service.get_run(session, run_id)
        again = service.start_again(session, jobs, run).id
        assert service.progress(session, run).is_stale
    assert applied == progress.images_total
    progress, doubts = ended(database, runs, again)
    assert doubts == []
    assert progress.poses == progress.detections > 0

    with database.writing() as session:
        clocks.undo(session, clocks.get_offset(session, offset.id))
        assert service.progress(session, service.get_run(session, again)).is_stale
        # Nearly right: vessels are matched, and still ten seconds from where they were.
        clocks.add_offset(session, too_little(harbour.camera.id))
        third = service.start_again(session, jobs, run).id
    progress, (doubt,) = ended(database, runs, third)
    with database.reading() as session:
        outcomes = dict(service.outcomes(session, third))
    assert doubt.result is not None
    assert abs(doubt.result["offset_s"] - SLOW_S) < 1.0
    assert progress.poses == progress.matches == 0
    assert outcomes["Withheld: clock suspect"] == doubt.result["withheld_matches"] > 0


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_few_vessels_say_nothing_of_a_clock(
    database: Database, start_worker: StartWorker, runs: Runs
) -> None:
    """Two moving ships are no witnesses: their matches are shown."""
    with database.writing() as session:
        harbour = make_harbour(session, images=0)
        harbour.model.family = IMPORTED_FAMILY
        photograph_passages(
            session, harbour, 8.0, settings_sha256=IMPORTED_SETTINGS_SHA256, ships=2
        )
    start_worker()
    run_id = runs.start(harbour.viewport.id, harbour.model.name)
    progress, doubts = ended(database, runs, run_id)
    with database.reading() as session:
        states = session.scalar(sa.select(sa.func.count()).select_from(VesselStateRow))
    assert (doubts, states and states > 0) == ([], True)
    assert progress.poses > 0
