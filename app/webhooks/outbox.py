"""What has ended is noted for a site's webhooks, in the transaction that ends it.

Whoever ends a run or an export calls `announce` with the same session: the delivery is there when
the end is, and is sent by a worker after that (`worker/webhooks.py`).
"""

from collections.abc import Collection, Mapping
from typing import Any

from sqlalchemy.orm import Session

from app.db import now
from app.tables.webhooks import Webhook, WebhookDelivery, WebhookEvent
from app.webhooks import repository


def announce(
    session: Session,
    event: WebhookEvent,
    site_ids: Collection[int] | None,
    data: Mapping[str, Any],
) -> None:
    """Note an event for the webhooks of some sites (None: of all) that want it."""
    for webhook in repository.listening(session, site_ids):
        if event.value in webhook.events:
            note(session, webhook, event, data)


def note(
    session: Session, webhook: Webhook, event: WebhookEvent, data: Mapping[str, Any]
) -> WebhookDelivery:
    """Note one delivery to one webhook."""
    moment = now()
    content = {"type": event.value, "timestamp": moment.isoformat(), "data": dict(data)}
    delivery = WebhookDelivery(
        webhook_id=webhook.id, event=event, content=content, next_try_at=moment
    )
    session.add(delivery)
    session.flush()
    return delivery
