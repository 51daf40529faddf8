"""SQL of webhooks and their deliveries."""

from collections.abc import Collection, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.webhooks import DeliveryStatus, Webhook, WebhookDelivery


def get(session: Session, webhook_id: int) -> Webhook | None:
    """Return a webhook."""
    return find(session, Webhook, webhook_id)


def get_delivery(session: Session, delivery_id: int) -> WebhookDelivery | None:
    """Return a delivery."""
    return find(session, WebhookDelivery, delivery_id)


def of_site(session: Session, site_id: int) -> Sequence[Webhook]:
    """Return a site's webhooks, oldest first."""
    return session.scalars(
        sa.select(Webhook).where(Webhook.site_id == site_id).order_by(Webhook.id)
    ).all()


def listening(session: Session, site_ids: Collection[int] | None) -> Sequence[Webhook]:
    """Return the webhooks of some sites (None: of all) that are switched on."""
    statement = sa.select(Webhook).where(Webhook.enabled)
    if site_ids is not None:
        statement = statement.where(Webhook.site_id.in_(site_ids))
    return session.scalars(statement.order_by(Webhook.id)).all()


def versions(session: Session) -> dict[int, int]:
    """Return the versions of the webhooks that are switched on, by id."""
    rows = session.execute(sa.select(Webhook.id, Webhook.version).where(Webhook.enabled))
    return {row[0]: row[1] for row in rows}


def deliveries(
    session: Session, webhook_id: int, paging: Paging
) -> tuple[Sequence[WebhookDelivery], str | None]:
    """Return a page of a webhook's deliveries, oldest first."""
    statement = sa.select(WebhookDelivery).where(WebhookDelivery.webhook_id == webhook_id)
    return fetch_page(session, statement, WebhookDelivery.id, paging)


def newest_deliveries(
    session: Session, webhook_ids: Collection[int], limit: int
) -> Sequence[WebhookDelivery]:
    """Return the newest deliveries of some webhooks."""
    return session.scalars(
        sa.select(WebhookDelivery)
        .where(WebhookDelivery.webhook_id.in_(webhook_ids))
        .order_by(WebhookDelivery.id.desc())
        .limit(limit)
    ).all()


def due(session: Session, webhook_id: int, moment: datetime) -> WebhookDelivery | None:
    """Return the delivery of a webhook that is to be tried next."""
    return session.scalar(
        sa.select(WebhookDelivery)
        .where(
            WebhookDelivery.webhook_id == webhook_id,
            WebhookDelivery.status == DeliveryStatus.WAITING,
            WebhookDelivery.next_try_at <= moment,
        )
        .order_by(WebhookDelivery.next_try_at, WebhookDelivery.id)
        .limit(1)
    )
