"""The loop of a standing run: look every few seconds whether images or reports have come."""

import threading

from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.live import standing
from worker.leases import Held, confirm

LOOK_EVERY_S = 2.0


class StandingLoops:
    """What the supervisor runs for standing runs (see worker/loops.py)."""

    name = standing.LEASE_PREFIX

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._jobs = JobClient(settings.database_url)

    def wanted(self, session: Session) -> dict[int, int]:
        """Return the standing runs that are not paused, each with its version."""
        return dict(standing.wanted(session))

    def run(self, item_id: int, lease: Held, stop: threading.Event) -> None:
        """Look after a standing run until told to stop."""
        while not stop.wait(LOOK_EVERY_S):
            with self._database.writing() as session:
                confirm(session, lease)
                standing.look_after(session, self._jobs, item_id)
