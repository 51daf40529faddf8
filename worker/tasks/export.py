"""The export job: writes a file into the store, then says where it is."""

from sqlalchemy.orm import Session

from app.db import Database
from app.exports import service
from app.jobs import JobRunner
from app.storage import Storage


class MakeExport:
    """Does the jobs of exports."""

    job = service.EXPORT_JOB

    def __init__(self, runner: JobRunner, database: Database, storage: Storage) -> None:
        self._runner = runner
        self._database = database
        self._storage = storage

    def do(self, export_id: int) -> None:
        """Write an export's file."""
        self._runner.step("begin", self._begin, export_id)
        self._runner.step("write", self._write, export_id)

    def fail(self, reason: str, export_id: int) -> None:
        """Say that an export failed, and why."""
        service.fail(self._runner.session(), export_id, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that an export's job is not tried again, and why."""
        service.fail_job(session, job_id, reason)

    def _begin(self, export_id: int) -> None:
        service.begin(self._runner.session(), export_id)

    def _write(self, export_id: int) -> None:
        try:
            stored, what = service.make_file(self._database, self._storage, export_id)
        except service.NoLongerWanted:
            return
        service.finish(self._runner.session(), export_id, stored, what)
