"""The loop that looks whether an alarm is to be mailed, in one worker at a time.

Without a mail server there is none: pages show what is wrong all the same.
"""

import threading

from sqlalchemy.orm import Session

from app.alarms import service
from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.storage import Storage
from worker.leases import Held, confirm


class AlarmLoop:
    """Looks at once, and then every half minute."""

    name = "alarms"

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._settings = settings
        self._storage = Storage(settings.storage_url)
        self._jobs = JobClient(settings.database_url)

    def wanted(self, session: Session) -> dict[int, int]:  # noqa: ARG002  as all loops are asked
        """Say that there is one such loop where mail can be sent."""
        return {1: 1} if self._settings.sends_mail else {}

    def run(
        self,
        item_id: int,  # noqa: ARG002  there is one
        lease: Held,
        stop: threading.Event,
    ) -> None:
        """Look until told to stop."""
        pause_s = 0.0
        while not stop.wait(pause_s):
            with self._database.reading() as session:
                found = service.what_is_wrong(session, self._settings, self._storage)
            with self._database.writing() as session:
                confirm(session, lease)
                service.look(session, self._jobs, found)
            pause_s = self._settings.alarms_look_every_s
