"""What a command works on: settings, database, file store and jobs of this installation.

Opened only when a command runs, because opening imports half of the application, and `--help`
should not wait for that.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING

from app import schema
from app.config import Settings, get_settings
from app.db import Database
from app.logs import configure_logs
from app.storage import Storage

if TYPE_CHECKING:
    from app.jobs import JobClient


class Installation:
    """The parts that commands ask services to work with."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.database = Database(settings.database_url)
        self.storage = Storage(settings.storage_url)

    @cached_property
    def jobs(self) -> "JobClient":
        """The jobs; few commands need them, and their engine takes a while to load."""
        from app.jobs import JobClient  # noqa: PLC0415  see above

        return JobClient(self.settings.database_url)

    def close(self) -> None:
        """Let go of the database."""
        if "jobs" in self.__dict__:
            self.jobs.destroy()
        self.database.dispose()


@contextmanager
def open_installation() -> Iterator[Installation]:
    """Give this installation's parts and close them afterwards.

    Raises Conflict while the database is not at this version.
    """
    configure_logs(logging.WARNING)
    here = Installation(get_settings())
    try:
        schema.refuse_other_version(here.database)
        yield here
    finally:
        here.close()
