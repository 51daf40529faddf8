"""Jobs: with `app.job_tables` the only module that knows the engine (DBOS Transact).

A job is a durable workflow: a name, JSON arguments, and steps whose results are kept, so that a
worker that takes over from a dead one goes on after the last finished step. The web only enqueues,
inside the transaction that stores what the job is about, and cancels; workers do.
"""

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypeVar

import sqlalchemy as sa
import structlog
from dbos import DBOS, DBOSClient, DBOSConfig, SQLAlchemyDatasource
from dbos._serialization import DBOSPortableJSONSerializer
from sqlalchemy.orm import Session

from app.db import BUSY_TIMEOUT_MS, IDLE_LIMIT, json_text
from app.errors import AppError
from app.tables.operation import Takeover

if TYPE_CHECKING:
    from dbos import EnqueueOptions
    from dbos._datasource import DatasourceOptions

log = structlog.get_logger()
Result = TypeVar("Result")
APPLICATION = "quaymark"
LONGEST_REASON = 500
NO_ROOM = "database or disk is full"  # SQLite's words for SQLITE_FULL
# A fixed version: jobs begun before an upgrade go on after it.
APPLICATION_VERSION = "1"
os.environ.setdefault("DBOS__APPVERSION", APPLICATION_VERSION)


class JobQueue(StrEnum):
    """Long work must not keep short work waiting."""

    RUNS = "runs"
    SHORT = "short"
    MAIL = "mail"


@dataclass(frozen=True, slots=True)
class PendingJob:
    """A job under way: where it was queued, and the worker that has it."""

    job_id: str
    queue: str
    executor_id: str


def make_job_engine(database_url: str) -> sa.Engine:
    """Make an engine as the job engine needs it.

    On SQLite it takes the writer's lock at the first writing statement, not at the first
    statement: the engine reads on a second connection while a step's transaction is open.
    """
    if not database_url.startswith("sqlite"):
        return sa.create_engine(
            database_url,
            pool_size=10,
            max_overflow=10,
            pool_pre_ping=True,
            json_serializer=json_text,
        )
    engine = sa.create_engine(
        database_url,
        connect_args={"timeout": BUSY_TIMEOUT_MS / 1000},
        json_serializer=json_text,
    )

    @sa.event.listens_for(engine, "connect")
    def _configure(connection: Any, _record: object) -> None:  # noqa: ANN401  a driver's object
        connection.isolation_level = "IMMEDIATE"
        for pragma in (
            "journal_mode=WAL",
            f"busy_timeout={BUSY_TIMEOUT_MS}",
            "foreign_keys=ON",
            "synchronous=FULL",
        ):
            connection.execute(f"PRAGMA {pragma}")

    return engine


def end_idle(engine: sa.Engine, limit_s: float) -> None:
    """Have Postgres end a frozen worker's transactions, which keep others waiting for its locks.

    Set once a connection, not once a transaction: a step's begins with its first statement, and
    it may compute before that for as long as it likes.
    """

    @sa.event.listens_for(engine, "connect")
    def _limit(connection: Any, _record: object) -> None:  # noqa: ANN401  a driver's object
        with connection.cursor() as cursor:
            cursor.execute(f"SET {IDLE_LIMIT} = {int(limit_s * 1000)}")
        connection.commit()


def wait_for_room(engine: sa.Engine) -> None:
    """Make a worker on SQLite wait while the disk is full, as it waits for a Postgres that is.

    The engine tries again what failed with its connection, and fails a job for anything else.
    """

    @sa.event.listens_for(engine, "handle_error")
    def _full(context: sa.engine.ExceptionContext) -> None:
        if NO_ROOM in str(context.original_exception):
            log.warning("waiting for room on the disk", error=NO_ROOM)
            context.is_disconnect = True
            context.invalidate_pool_on_disconnect = False


def migrate_job_tables(database_url: str) -> None:
    """Create or migrate the engine's own tables in the application's database."""
    DBOS.migrate(database_url)
    SQLAlchemyDatasource.migrate(database_url)


class JobClient:
    """The web's and the command line's view of the jobs: enqueue and cancel, never run."""

    def __init__(self, database_url: str) -> None:
        self._engine = make_job_engine(database_url)
        self._client = DBOSClient(
            system_database_engine=self._engine,
            serializer=DBOSPortableJSONSerializer(),
            application_name=APPLICATION,
            lazy=True,
        )

    def enqueue(
        self,
        session: Session,
        job: str,
        *arguments: object,
        queue: JobQueue,
        job_id: str,
        priority: int = 10,
    ) -> None:
        """Enqueue in the caller's transaction: the job exists when the caller's rows do."""
        options: EnqueueOptions = {
            "workflow_name": job,
            "queue_name": queue.value,
            "workflow_id": job_id,
            "priority": priority,
        }
        self._client.enqueue_in_transaction(session, options, *arguments)

    def cancel(self, job_id: str) -> None:
        """Stop a job before its next step; a finished one stays finished."""
        self._client.cancel_workflow(job_id)

    def destroy(self) -> None:
        """Close all connections."""
        self._client.destroy()
        self._engine.dispose()


class JobRunner:
    """A worker's view of the jobs: runs what is queued, resumes what others left."""

    def __init__(
        self, database_url: str, executor_id: str, *, concurrency: int, idle_limit_s: float
    ) -> None:
        self._engine = make_job_engine(database_url)
        wait_for_room(self._engine)
        self._executor_id = executor_id
        self._concurrency = concurrency
        self._under_way: list[str] = []
        self._leaving = threading.Event()
        self._idle: frozenset[str] = frozenset()
        self._is_sqlite = database_url.startswith("sqlite")
        if not self._is_sqlite:
            end_idle(self._engine, idle_limit_s)
        config: DBOSConfig = {
            "name": APPLICATION,
            "system_database_engine": self._engine,
            "application_version": APPLICATION_VERSION,
            "executor_id": executor_id,
            "serializer": DBOSPortableJSONSerializer(),
            "run_migrations": False,
            "enable_otlp": False,
            "log_level": "WARNING",
        }
        DBOS(config=config)
        self._datasource = SQLAlchemyDatasource.create(
            database_url,
            engine=self._engine,
            serializer=DBOSPortableJSONSerializer(),
            run_migrations=False,
        )

    def register(self, name: str, do: Callable[..., None], fail: Callable[..., None]) -> None:
        """Make a function the body of the jobs with this name; before `launch`.

        When it raises, `fail(reason, *arguments)` is a last step that tells the user.
        """

        def body(*arguments: Any) -> None:  # noqa: ANN401  JSON
            job_id = DBOS.workflow_id or ""
            self._under_way.append(job_id)
            try:
                do(*arguments)
            except Exception as error:
                log.exception("job failed", job=name, arguments=arguments)
                self.step("fail", fail, reason_of(error), *arguments)
                raise
            finally:
                self._under_way.remove(job_id)

        DBOS.workflow(name=name)(body)

    def launch(self) -> None:
        """Begin to take jobs."""
        DBOS.launch()
        for queue in JobQueue:
            DBOS.register_queue(
                queue.value,
                worker_concurrency=self._concurrency,
                polling_interval_sec=0.2,
                on_conflict="always_update",
            )

    def leave(self) -> None:
        """Begin no further step: the process is about to end, and others resume its jobs."""
        self._leaving.set()

    def destroy(self) -> None:
        """Stop taking jobs; what is under way is left to be resumed."""
        DBOS.destroy(workflow_completion_timeout_sec=0)
        self._engine.dispose()

    def step(self, name: str, function: Callable[..., Result], *arguments: object) -> Result:
        """Do a step of a job once: what it stores and the note that it is done are one commit.

        The function computes first and touches `session()` last, because on SQLite the first
        writing statement takes the database's only writer's place until the step ends.
        """
        if self._leaving.is_set():
            threading.Event().wait()  # until the process ends

        def advance() -> Result:
            result = function(*arguments)
            # A job that gets on is not the one that keeps killing its workers.
            self.session().execute(
                sa.delete(Takeover).where(Takeover.workflow_id == DBOS.workflow_id)
            )
            return result

        options: DatasourceOptions = {
            "name": name,
            "isolation_level": "SERIALIZABLE" if self._is_sqlite else "READ COMMITTED",
        }
        return self._datasource.run_tx_step(options, advance)

    @staticmethod
    def sleep(seconds: float) -> None:
        """Let a job pause between two steps; a worker that takes it over waits the rest only."""
        DBOS.sleep(seconds)

    def session(self) -> Session:
        """Return the open step's session."""
        return self._datasource.sql_session()

    @staticmethod
    def pending() -> list[PendingJob]:
        """Return the jobs under way, on whatever worker."""
        return [
            PendingJob(
                job.workflow_id, job.queue_name or JobQueue.SHORT.value, job.executor_id or ""
            )
            for job in DBOS.list_workflows(status="PENDING", load_input=False, load_output=False)
        ]

    def dropped(self, pending: Sequence[PendingJob]) -> frozenset[str]:
        """Return the ids of pending jobs that are this worker's and that it does nothing for.

        The engine lets go of a job when not even its failure could be stored.
        Only what was so at the last call too is told: a job just taken has not begun yet.
        """
        own = {job.job_id for job in pending if job.executor_id == self._executor_id}
        idle = frozenset(own.difference(self._under_way))
        twice, self._idle = idle & self._idle, idle
        return twice

    @staticmethod
    def resume(job_id: str, queue: str) -> None:
        """Put an orphaned job back into its queue; its old worker is fenced off."""
        DBOS.resume_workflow(job_id, queue_name=queue)

    @staticmethod
    def cancel(job_id: str) -> None:
        """Stop a job for good."""
        DBOS.cancel_workflow(job_id)


def reason_of(error: Exception) -> str:
    """Return why a job failed, in one line: our own words, or a library's without its SQL."""
    if isinstance(error, AppError):
        return error.detail
    lines = str(error).strip().splitlines() or ["no reason given"]
    is_ours = type(error).__module__.startswith(("app.", "worker."))
    return ("" if is_ours else f"{type(error).__name__}: ") + lines[0][:LONGEST_REASON]
