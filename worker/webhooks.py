"""The loops that send deliveries, one for each webhook: a receiver that stalls delays only its own.

What is sent may be sent again when a worker dies before it could note that it was: the delivery's
id tells the receiver.
"""

import threading

from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.webhooks import service
from worker.leases import Held, confirm


class WebhookLoops:
    """What the supervisor runs for webhooks (see worker/loops.py)."""

    name = "webhook"

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._settings = settings

    def wanted(self, session: Session) -> dict[int, int]:
        """Return the webhooks that are switched on, each with its version."""
        return service.versions(session)

    def run(self, item_id: int, lease: Held, stop: threading.Event) -> None:
        """Send what is due until told to stop."""
        while not stop.is_set():
            with self._database.reading() as session:
                found = service.due(session, item_id)
            if found is None:
                stop.wait(self._settings.webhook_look_every_s)
                continue
            webhook, delivery = found
            outcome = service.attempt(self._settings, webhook, delivery)
            with self._database.writing() as session:
                confirm(session, lease)
                service.settle(session, self._settings, delivery.id, outcome)
