"""The loop that once a day clears up after killed writers and hashes all stored files again."""

import threading
from collections.abc import Mapping

import structlog
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.keeping.files import check_files
from app.storage import Storage
from worker.leases import Held

log = structlog.get_logger()
FIRST_AFTER_S = 600.0  # a worker that has just begun has better things to do
EVERY_S = 86_400.0


class RehashLoop:
    """Looks at the files, waits a day, looks again."""

    name = "rehash"

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._storage = Storage(settings.storage_url)
        self._bytes_per_s = settings.rehash_bytes_per_s

    def wanted(self, session: Session) -> Mapping[int, int]:  # noqa: ARG002  as all loops are asked
        """Say that there is one such loop, always."""
        return {1: 1}

    def run(
        self,
        item_id: int,  # noqa: ARG002  there is one
        lease: Held,  # noqa: ARG002  two at once would only find the same
        stop: threading.Event,
    ) -> None:
        """Look at all files day by day until told to stop."""
        pause_s = FIRST_AFTER_S
        while not stop.wait(pause_s):
            log.info("drafts of killed writers removed", files=self._storage.remove_drafts())
            checked = check_files(
                self._database, self._storage, bytes_per_s=self._bytes_per_s, stop=stop
            )
            log.info(
                "stored files hashed again",
                files=checked.files,
                missing=checked.missing,
                damaged=checked.damaged,
            )
            pause_s = EVERY_S
