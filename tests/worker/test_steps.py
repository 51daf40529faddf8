"""Steps of jobs: what others can do meanwhile, what a failure leaves, how often a step happens."""

import threading
import time
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.errors import Conflict
from app.jobs import JobClient, JobQueue, JobRunner
from app.tables.sites import Site
from tests.factories.sites import make_site
from tests.worker_process import wait_until

IDLE_LIMIT_S = 1.0


@pytest.fixture
def runner(settings: Settings) -> Iterator[JobRunner]:
    """Give a worker's view of the jobs, in the test's own process."""
    name = f"test-{uuid.uuid4().hex[:8]}"
    running = JobRunner(settings.database_url, name, concurrency=1, idle_limit_s=IDLE_LIMIT_S)
    yield running
    running.destroy()


@pytest.fixture
def client(settings: Settings) -> Iterator[JobClient]:
    """Give the web's view of the jobs."""
    opened = JobClient(settings.database_url)
    yield opened
    opened.destroy()


def enqueue(database: Database, client: JobClient, *arguments: object) -> str:
    """Put a job into the queue; returns its id."""
    job_id = f"job-{uuid.uuid4()}"
    with database.writing() as session:
        client.enqueue(session, "tested", *arguments, queue=JobQueue.SHORT, job_id=job_id)
    return job_id


def site_names(database: Database) -> set[str]:
    """Return the names of all sites."""
    with database.reading() as session:
        return set(session.scalars(sa.select(Site.name)))


def launch(runner: JobRunner) -> None:
    """Begin to take jobs, from a thread of its own.

    A browser test before this one leaves an event loop running in the main thread, and the job
    engine refuses to start inside one.
    """
    with ThreadPoolExecutor(1) as pool:
        pool.submit(runner.launch).result()


def nothing(*_arguments: object) -> None:
    """Do nothing."""


def test_others_write_while_a_step_computes(
    database: Database, runner: JobRunner, client: JobClient
) -> None:
    """A step that computes, for however long, holds no lock, and stores beside what others did."""
    computing, written = threading.Event(), threading.Event()
    tries: list[str] = []

    def compute_then_store() -> None:
        tries.append("once")
        computing.set()
        assert written.wait(60)
        if not database.is_sqlite:
            time.sleep(1.2 * IDLE_LIMIT_S)
        make_site(runner.session(), "of the step")

    runner.register("tested", lambda: runner.step("work", compute_then_store), nothing)
    launch(runner)
    enqueue(database, client)
    assert computing.wait(60)
    with database.writing() as session:
        make_site(session, "of somebody else")
    assert site_names(database) == {"of somebody else"}
    written.set()
    wait_until(lambda: "of the step" in site_names(database), what="the step's end")
    assert tries == ["once"]


def test_a_failed_step_leaves_nothing_but_its_reason(
    database: Database, runner: JobRunner, client: JobClient
) -> None:
    """What a step stored before it failed is gone; the reason reaches whoever tells the user."""
    told: list[tuple[str, object]] = []

    def store_then_fail(name: str) -> None:
        make_site(runner.session(), name)
        runner.session().flush()
        raise Conflict("the harbour is closed")

    def tell(reason: str, name: str) -> None:
        told.append((reason, name))

    runner.register("tested", lambda name: runner.step("work", store_then_fail, name), tell)
    launch(runner)
    enqueue(database, client, "never")
    wait_until(lambda: bool(told), what="the reason")
    assert told == [("the harbour is closed", "never")]
    assert site_names(database) == set()


def test_a_job_exists_when_its_rows_do(database: Database, client: JobClient) -> None:
    """A job enqueued in a transaction that is rolled back was never there."""

    def store_and_enqueue() -> None:
        with database.writing() as session:
            make_site(session, "never")
            client.enqueue(session, "tested", queue=JobQueue.SHORT, job_id="lost")
            raise Conflict("the harbour is closed")

    with pytest.raises(Conflict):
        store_and_enqueue()
    assert site_names(database) == set()
    assert job_count(database) == 0
    enqueue(database, client)
    assert job_count(database) == 1


def job_count(database: Database) -> int:
    """Count the engine's jobs."""
    schema = "" if database.url.startswith("sqlite") else "dbos."
    with database.reading() as session:
        count: int = session.scalar(sa.text(f"SELECT count(*) FROM {schema}workflow_status"))  # noqa: S608  one of two constants
        return count


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # SQLite has no server
def test_a_lost_connection_is_made_anew(
    database: Database, runner: JobRunner, client: JobClient
) -> None:
    """A database server that ends all connections in mid-step only delays the job."""
    attempts: list[int] = []

    def store() -> None:
        attempts.append(1)
        session = runner.session()
        make_site(session, "kept")
        if len(attempts) == 1:
            _end_other_connections(database)

    runner.register("tested", lambda: runner.step("work", store), nothing)
    launch(runner)
    enqueue(database, client)
    wait_until(lambda: site_names(database) == {"kept"}, what="the step's end")
    assert len(attempts) == 2


def _end_other_connections(database: Database) -> None:
    with database.writing() as session:
        _terminate(session)


def _terminate(session: Session) -> None:
    session.execute(
        sa.text(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
            "WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )
    )
