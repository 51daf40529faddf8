"""Webhooks of a site: set up, signed, tried and tried again.

A delivery that fails is tried after longer and longer pauses, then given up with the reason, and
can be sent again by hand. Its id stays the same, so that a receiver knows what it has.
"""

import json
from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.addresses import AddressError
from app.config import Settings
from app.db import now
from app.errors import Conflict, Invalid, NotFound
from app.paging import Paging
from app.tables.webhooks import DeliveryStatus, Webhook, WebhookDelivery, WebhookEvent
from app.webhooks import repository
from app.webhooks.outbox import note
from app.webhooks.sending import Outcome, deliver, destination
from app.webhooks.signing import headers, new_secret

MOST_WEBHOOKS = 20
BOTH_SIGN_FOR = timedelta(days=1)
SHOWN = 50


def check_destination(settings: Settings, url: str) -> None:
    """Raise Invalid for an address that webhooks may not go to, or that nobody knows.

    Asks the name server, so before the first statement of a writing session.
    """
    try:
        destination(url, settings.webhook_allowed_networks)
    except AddressError as error:
        raise Invalid.field("url", str(error)) from error


def get_webhook(session: Session, webhook_id: int) -> Webhook:
    """Return a webhook. Raises NotFound."""
    webhook = repository.get(session, webhook_id)
    if webhook is None:
        raise NotFound("there is no such webhook")
    return webhook


def get_delivery(session: Session, delivery_id: int) -> WebhookDelivery:
    """Return a delivery. Raises NotFound."""
    delivery = repository.get_delivery(session, delivery_id)
    if delivery is None:
        raise NotFound("there is no such delivery")
    return delivery


def of_site(session: Session, site_id: int) -> Sequence[Webhook]:
    """Return a site's webhooks, oldest first."""
    return repository.of_site(session, site_id)


def deliveries(
    session: Session, webhook_id: int, paging: Paging
) -> tuple[Sequence[WebhookDelivery], str | None]:
    """Return a page of a webhook's deliveries, oldest first."""
    return repository.deliveries(session, webhook_id, paging)


def newest_deliveries(session: Session, webhooks: Sequence[Webhook]) -> Sequence[WebhookDelivery]:
    """Return the newest deliveries of some webhooks."""
    return repository.newest_deliveries(session, [webhook.id for webhook in webhooks], SHOWN)


def add(session: Session, webhook: Webhook) -> Webhook:
    """Store a webhook with a fresh secret. Raises Conflict for one more than a site may have."""
    if len(repository.of_site(session, webhook.site_id)) >= MOST_WEBHOOKS:
        raise Conflict(f"a site has at most {MOST_WEBHOOKS} webhooks; remove one first")
    webhook.secret = new_secret()
    session.add(webhook)
    session.flush()
    return webhook


def rotate(session: Session, webhook: Webhook) -> str:
    """Give a webhook a new secret; for a day the old one signs, too."""
    webhook.old_secret, webhook.old_secret_until = webhook.secret, now() + BOTH_SIGN_FOR
    webhook.secret = new_secret()
    session.flush()
    return webhook.secret


def test(session: Session, webhook: Webhook) -> WebhookDelivery:
    """Note a delivery that only says that the webhook works. Raises Conflict while it is off."""
    if not webhook.enabled:
        raise Conflict("the webhook is switched off; switch it on first")
    return note(session, webhook, WebhookEvent.TEST, {"webhook_id": webhook.id})


def send_again(session: Session, delivery: WebhookDelivery) -> WebhookDelivery:
    """Let a delivery that has ended be tried anew. Raises Conflict for one under way."""
    if delivery.status is DeliveryStatus.WAITING:
        raise Conflict("the delivery is under way already")
    delivery.status, delivery.attempts = DeliveryStatus.WAITING, 0
    delivery.next_try_at, delivery.finished_at = now(), None
    session.flush()
    return delivery


def versions(session: Session) -> dict[int, int]:
    """Return the versions of the webhooks that are switched on, by id."""
    return repository.versions(session)


def due(session: Session, webhook_id: int) -> tuple[Webhook, WebhookDelivery] | None:
    """Return a webhook with the delivery that is to be tried next; None while there is none."""
    webhook = repository.get(session, webhook_id)
    delivery = repository.due(session, webhook_id, now())
    return None if webhook is None or delivery is None else (webhook, delivery)


def attempt(settings: Settings, webhook: Webhook, delivery: WebhookDelivery) -> Outcome:
    """Try a delivery once; takes as long as the receiver does, so outside of a transaction."""
    moment = now()
    body = json.dumps(delivery.content, sort_keys=True, separators=(",", ":")).encode()
    return deliver(
        webhook.url,
        body,
        headers(_keys(webhook, moment), f"dlv_{delivery.id}", moment, body),
        allowed_networks=settings.webhook_allowed_networks,
        timeout_s=settings.webhook_timeout_s,
    )


def _keys(webhook: Webhook, moment: datetime) -> list[str]:
    old, until = webhook.old_secret, webhook.old_secret_until
    return [webhook.secret] + ([old] if old and until and moment < until else [])


def settle(session: Session, settings: Settings, delivery_id: int, outcome: Outcome) -> None:
    """Store how a try went, and when the next one is, if there is one."""
    delivery = repository.get_delivery(session, delivery_id)
    if delivery is None:
        return
    moment, pauses_s = now(), settings.webhook_pauses_s
    delivery.attempts += 1
    delivery.answer_status, delivery.error = outcome.status, outcome.reason
    if outcome.reason is None:
        delivery.status, delivery.finished_at = DeliveryStatus.DELIVERED, moment
    elif delivery.attempts > len(pauses_s):
        delivery.status, delivery.finished_at = DeliveryStatus.FAILED, moment
    else:
        delivery.next_try_at = moment + timedelta(seconds=pauses_s[delivery.attempts - 1])
