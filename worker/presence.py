"""Heartbeat and takeover: which workers live, and whose jobs go on elsewhere."""

import os
import socket
import threading
import time
from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
import structlog
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import DBAPIError

from app import __version__
from app.config import Settings
from app.db import Database
from app.jobs import JobRunner
from app.tables.operation import Takeover, WorkerHeartbeat
from worker.moments import common_moment

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
        self._insert = (sqlite if settings.is_sqlite else postgresql).insert
        self._beaten_at_s = time.monotonic()
        self._was_late = False

    def announce(self) -> None:
        """Say for the first time that this worker lives."""
        self._beat()

    def keep(self, stop: threading.Event, parent_pid: int) -> None:
        """Beat and look after orphaned jobs until told to stop or the parent process is gone."""
        while not stop.wait(self._settings.heartbeat_s):
            if parent_pid and os.getppid() != parent_pid:
                log.warning("parent is gone")
                return
            try:
                self._beat()
                if not self._is_back_from_a_standstill():
                    self._take_over()
            except DBAPIError as error:
                # A database that is away for a moment must not end the worker.
                log.warning("heartbeat failed", error=str(error.orig))

    def withdraw(self) -> None:
        """Say good-bye, so that the jobs under way go on elsewhere at once."""
        with self._database.writing() as session:
            session.execute(
                sa.delete(WorkerHeartbeat).where(WorkerHeartbeat.executor_id == self._executor_id)
            )

    def _is_back_from_a_standstill(self) -> bool:
        """Tell whether this worker was silent itself for as long as makes others dead.

        What held it up, a machine asleep or far too busy, held up the others too: they get a
        round to speak first. Only one, so that the dead are found where all is always late.
        """
        before_s, self._beaten_at_s = self._beaten_at_s, time.monotonic()
        is_late = self._beaten_at_s - before_s > self._settings.takeover_after_s
        is_first, self._was_late = is_late and not self._was_late, is_late
        return is_first

    def _beat(self) -> None:
        with self._database.writing() as session:
            moment = common_moment(session)
            row = {
                "executor_id": self._executor_id,
                "host": socket.gethostname(),
                "pid": os.getpid(),
                "code_version": __version__,
                "started_at": moment,
                "last_seen_at": moment,
            }
            # Insert again if need be: others forget a worker that was asleep for an hour.
            session.execute(
                self._insert(WorkerHeartbeat)
                .values(row)
                .on_conflict_do_update(
                    index_elements=[WorkerHeartbeat.executor_id], set_={"last_seen_at": moment}
                )
            )
            session.execute(
                sa.delete(WorkerHeartbeat).where(
                    WorkerHeartbeat.last_seen_at < moment - FORGET_AFTER
                )
            )

    def _live_executors(self) -> frozenset[str]:
        """Return who was heard of lately, and this worker: it lives, however late its words are."""
        with self._database.reading() as session:
            oldest = common_moment(session) - timedelta(seconds=self._settings.takeover_after_s)
            heard = session.scalars(
                sa.select(WorkerHeartbeat.executor_id).where(WorkerHeartbeat.last_seen_at >= oldest)
            )
            return frozenset(heard) | {self._executor_id}

    def _take_over(self) -> None:
        # In this order: whoever has a job by now has announced itself before.
        pending = self._runner.pending()
        live = self._live_executors()
        dropped = self._runner.dropped(pending)
        for job in pending:
            if job.executor_id in live and job.job_id not in dropped:
                continue
            attempts = self._claim(job.job_id)
            if attempts is None:
                continue
            if attempts > MOST_TAKEOVERS:
                log.error("job given up", job_id=job.job_id, attempts=attempts)
                reason = f"its worker died {attempts} times at the same place; see the worker's log"
                # The reason first: were this worker to die here too, the next one says it again.
                self._give_up(job.job_id, reason)
                self._runner.cancel(job.job_id)
            else:
                log.warning("job taken over", job_id=job.job_id, attempts=attempts)
                self._runner.resume(job.job_id, job.queue)

    def _claim(self, job_id: str) -> int | None:
        """Count an attempt; None when another worker has just done so."""
        with self._database.writing() as session:
            moment = common_moment(session)
            recently = moment - timedelta(seconds=self._settings.takeover_after_s)
            attempts: int | None = session.scalar(
                self._insert(Takeover)
                .values(workflow_id=job_id, attempts=1, last_at=moment)
                .on_conflict_do_update(
                    index_elements=[Takeover.workflow_id],
                    set_={"attempts": Takeover.attempts + 1, "last_at": moment},
                    where=Takeover.last_at < recently,
                )
                .returning(Takeover.attempts)
            )
            return attempts
