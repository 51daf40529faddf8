"""The job of an AIS import: the upload that somebody looked at becomes a recording's reports."""

from sqlalchemy.orm import Session

from app.ais import uploads
from app.config import Settings
from app.db import Database
from app.jobs import JobRunner
from app.storage import Storage


class ImportAis:
    """Does the jobs of uploads."""

    job = uploads.IMPORT_JOB

    def __init__(
        self, runner: JobRunner, database: Database, storage: Storage, settings: Settings
    ) -> None:
        self._runner = runner
        self._database = database
        self._storage = storage
        self._settings = settings

    def do(self, upload_id: int) -> None:
        """Import an upload, in many short transactions; begun anew by whoever takes over."""
        uploads.run_import(self._database, self._storage, self._settings, upload_id)

    def fail(self, reason: str, upload_id: int) -> None:
        """Say that an upload was not imported, and why."""
        uploads.fail(self._runner.session(), upload_id, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that an upload's job is not tried again, and why."""
        uploads.fail_job(session, job_id, reason)
