"""Heartbeat and takeover: which workers live, and whose jobs go on elsewhere."""

import os
import socket
import threading
from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
import structlog
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import OperationalError

from app import __version__
from app.config import Settings
from app.db import Database, now
from app.jobs import JobRunner
from app.tables.operation import Takeover, WorkerHeartbeat

log = structlog.get_logger()
MOST_TAKEOVERS = 5
FORGET_AFTER = timedelta(hours=1)


class Presence:
    """One worker's heartbeat row, and its eye on the others'."""

    def __init__(
        self,
        database: Database,
        runner: JobRunner,
        settings: Settings,
        executor_id: str,
        give_up: Callable[[str, str], None],
    ) -> None:
        self._database = database
        self._runner = runner
        self._settings = settings
        self._executor_id = executor_id
        self._give_up = give_up

    def announce(self) -> None:
        """Say for the first time that this worker lives."""
        with self._database.writing() as session:
            session.add(
                WorkerHeartbeat(
                    executor_id=self._executor_id,
                    host=socket.gethostname(),
                    pid=os.getpid(),
                    code_version=__version__,
                )
            )

    def keep(self, stop: threading.Event, parent_pid: int) -> None:
        """Beat and look after orphaned jobs until told to stop or the parent process is gone."""
        while not stop.wait(self._settings.heartbeat_s):
            if parent_pid and os.getppid() != parent_pid:
                log.warning("parent is gone")
                return
            try:
                self._beat()
                self._take_over()
            except OperationalError as error:
                # A database that is away for a moment must not end the worker.
                log.warning("heartbeat failed", error=str(error.orig))

    def withdraw(self) -> None:
        """Say good-bye, so that the jobs under way go on elsewhere at once."""
        with self._database.writing() as session:
            session.execute(
                sa.delete(WorkerHeartbeat).where(WorkerHeartbeat.executor_id == self._executor_id)
            )

    def _beat(self) -> None:
        with self._database.writing() as session:
            session.execute(
                sa.update(WorkerHeartbeat)
                .where(WorkerHeartbeat.executor_id == self._executor_id)
                .values(last_seen_at=now())
            )
            session.execute(
                sa.delete(WorkerHeartbeat).where(
                    WorkerHeartbeat.last_seen_at < now() - FORGET_AFTER
                )
            )

    def _live_executors(self) -> list[str]:
        oldest = now() - timedelta(seconds=self._settings.takeover_after_s)
        with self._database.reading() as session:
            return list(
                session.scalars(
                    sa.select(WorkerHeartbeat.executor_id).where(
                        WorkerHeartbeat.last_seen_at >= oldest
                    )
                )
            )

    def _take_over(self) -> None:
        for job_id, queue in self._runner.orphans(self._live_executors()):
            attempts = self._claim(job_id)
            if attempts is None:
                continue
            if attempts > MOST_TAKEOVERS:
                log.error("job given up", job_id=job_id, attempts=attempts)
                self._runner.cancel(job_id)
                self._give_up(job_id, f"its worker died {attempts} times; see the worker's log")
            else:
                log.warning("job taken over", job_id=job_id, attempts=attempts)
                self._runner.resume(job_id, queue)

    def _claim(self, job_id: str) -> int | None:
        """Count an attempt; None when another worker has just done so."""
        insert = (sqlite if self._database.url.startswith("sqlite") else postgresql).insert
        recently = now() - timedelta(seconds=self._settings.takeover_after_s)
        statement = (
            insert(Takeover)
            .values(workflow_id=job_id, attempts=1, last_at=now())
            .on_conflict_do_update(
                index_elements=[Takeover.workflow_id],
                set_={"attempts": Takeover.attempts + 1, "last_at": now()},
                where=Takeover.last_at < recently,
            )
            .returning(Takeover.attempts)
        )
        with self._database.writing() as session:
            attempts: int | None = session.scalar(statement)
            return attempts
