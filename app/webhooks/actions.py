"""What callers do with webhooks: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.sites.actions import site_for
from app.tables.webhooks import Webhook, WebhookDelivery
from app.webhooks import service
from app.webhooks.schemas import WebhookIn, WebhookPatch


def webhook_for(session: Session, access: Access, webhook_id: int) -> Webhook:
    """Return a webhook of a site the caller administers. Raises NotFound, Forbidden."""
    webhook = service.get_webhook(session, webhook_id)
    access.require(Scope.ADMIN, webhook.site_id)
    return webhook


def check_new(
    database: Database, settings: Settings, access: Access, site_id: int, url: str
) -> None:
    """Refuse a webhook of a foreign site, or to an address that webhooks may not go to."""
    with database.reading() as session:
        site_for(session, access, Scope.ADMIN, site_id)
    service.check_destination(settings, url)


def check_change(
    database: Database, settings: Settings, access: Access, webhook_id: int, url: str | None
) -> None:
    """Refuse a change of a foreign webhook, or to an address that webhooks may not go to."""
    with database.reading() as session:
        webhook_for(session, access, webhook_id)
    if url is not None:
        service.check_destination(settings, url)


def add(session: Session, access: Access, site_id: int, data: WebhookIn) -> Webhook:
    """Set up a webhook, after `check_new`."""
    site = site_for(session, access, Scope.ADMIN, site_id)
    made = Webhook(site_id=site.id, created_by_id=access.user_id, **_columns(data.model_dump()))
    webhook = service.add(session, made)
    record(session, access, "create", "webhook", webhook.id, site.id, url=webhook.url)
    return webhook


def update(session: Session, access: Access, webhook: Webhook, data: WebhookPatch) -> Webhook:
    """Change, start or stop a webhook, after `check_change`."""
    changes = {
        name: value
        for name, value in data.model_dump(mode="json", exclude_unset=True).items()
        if value is not None
    }
    for name, value in _columns(changes).items():
        setattr(webhook, name, value)
    session.flush()
    record(session, access, "update", "webhook", webhook.id, webhook.site_id, changes=changes)
    return webhook


def rotate(session: Session, access: Access, webhook: Webhook) -> Webhook:
    """Give a webhook a new secret."""
    service.rotate(session, webhook)
    record(session, access, "rotate secret", "webhook", webhook.id, webhook.site_id)
    return webhook


def send_test(session: Session, access: Access, webhook: Webhook) -> WebhookDelivery:
    """Send a test delivery. Raises Conflict while the webhook is off."""
    delivery = service.test(session, webhook)
    record(session, access, "test", "webhook", webhook.id, webhook.site_id)
    return delivery


def send_again(session: Session, access: Access, delivery_id: int) -> WebhookDelivery:
    """Send a delivery once more. Raises NotFound, Forbidden, and Conflict while it is under way."""
    delivery = service.get_delivery(session, delivery_id)
    webhook = webhook_for(session, access, delivery.webhook_id)
    service.send_again(session, delivery)
    details = {"delivery_id": delivery.id}
    record(session, access, "send again", "webhook", webhook.id, webhook.site_id, **details)
    return delivery


def remove(session: Session, access: Access, webhook: Webhook) -> None:
    """Remove a webhook with its deliveries."""
    record(session, access, "delete", "webhook", webhook.id, webhook.site_id, url=webhook.url)
    session.delete(webhook)
    session.flush()


def _columns(values: dict[str, object]) -> dict[str, object]:
    events = values.get("events")
    return values if not isinstance(events, list) else values | {"events": list(map(str, events))}
