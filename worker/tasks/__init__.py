"""What workers do, by the name of the job.

Each task module offers a body for its jobs, what to write when a job fails, and what to write when
a job is given up because it keeps killing its workers.
"""

from collections.abc import Callable
from typing import Protocol

from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.jobs import JobRunner
from app.storage import Storage
from worker.tasks.calibrate import Calibrate
from worker.tasks.estimate_clock import EstimateClock
from worker.tasks.export import MakeExport
from worker.tasks.import_ais import ImportAis
from worker.tasks.probe import ProbeModel
from worker.tasks.reregister import Reregister
from worker.tasks.run_pipeline import RunPipeline
from worker.tasks.send_mail import letters


class Task(Protocol):
    """A kind of job: its name, its body, and what to write when it comes to nothing."""

    @property
    def job(self) -> str:
        """The name of the jobs."""

    @property
    def do(self) -> Callable[..., None]:
        """The body; called with the job's arguments."""

    @property
    def fail(self) -> Callable[..., None]:
        """The last step of a failed job; called with a reason and the job's arguments."""

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Tell that a job is not tried again."""


def register_tasks(
    runner: JobRunner, database: Database, settings: Settings
) -> Callable[[str, str], None]:
    """Register all jobs; returns what to call with (job id, reason) when one is given up."""
    storage = Storage(settings.storage_url)
    tasks: tuple[Task, ...] = (
        RunPipeline(runner, database, storage, settings),
        MakeExport(runner, database, storage),
        ProbeModel(runner, database, storage, settings),
        Reregister(runner, database, storage, settings),
        Calibrate(runner, database, storage, settings),
        EstimateClock(runner, database, storage, settings),
        ImportAis(runner, database, storage, settings),
        *letters(runner, database, settings),
    )
    for task in tasks:
        runner.register(task.job, task.do, task.fail)

    def give_up(job_id: str, reason: str) -> None:
        with database.writing() as session:
            for task in tasks:
                task.give_up(session, job_id, reason)

    return give_up
