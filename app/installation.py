"""What a command works on: settings, database, file store and jobs of this installation.

Opened only when a command runs, because opening imports half of the application, and `--help`
should not wait for that.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from app import schema
from app.config import Settings, get_settings
from app.db import Database
from app.jobs import JobClient
from app.logs import configure_logs
from app.storage import Storage


@dataclass(frozen=True, slots=True)
class Installation:
    """The parts that commands ask services to work with."""

    settings: Settings
    database: Database
    storage: Storage
    jobs: JobClient


@contextmanager
def open_installation() -> Iterator[Installation]:
    """Give this installation's parts and close them afterwards.

    Raises Conflict while the database is not at this version.
    """
    configure_logs(logging.WARNING)
    settings = get_settings()
    database = Database(settings.database_url)
    jobs = JobClient(settings.database_url)
    try:
        schema.refuse_other_version(database)
        yield Installation(settings, database, Storage(settings.storage_url), jobs)
    finally:
        jobs.destroy()
        database.dispose()
