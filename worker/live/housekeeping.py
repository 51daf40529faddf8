"""The loop that tidies up once a day: retention rules, and what was deleted 30 days ago."""

import threading

import structlog
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.deletions import service as deletions
from app.retention import service as retention
from app.storage import Storage
from worker.leases import Held

log = structlog.get_logger()
FIRST_AFTER_S = 300.0
EVERY_S = 86_400.0


class Housekeeping:
    """What the supervisor runs once for all sites (see worker/loops.py)."""

    name = "housekeeping"

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._storage = Storage(settings.storage_url)

    def wanted(self, _session: Session) -> dict[int, int]:
        """Return the one thing there is to do."""
        return {1: 1}

    def run(self, _item_id: int, _lease: Held, stop: threading.Event) -> None:
        """Tidy up every day until told to stop; doing it twice at once harms nothing."""
        pause_s = FIRST_AFTER_S
        while not stop.wait(pause_s):
            pause_s = EVERY_S
            applied = retention.apply_all(self._database, self._storage)
            removed = deletions.purge(self._database, self._storage)
            log.info("tidied up", by_rules=applied, **removed)
