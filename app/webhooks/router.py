"""REST of webhooks: a site's administrators set them up, look at deliveries, send them again.

Answers that hold a secret, which is shown once, are not kept for repetition (`Idempotency-Key`).
"""

from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, heed_if_match, set_etag
from app.dependencies import DatabaseDep, Page, PagingDep, SessionDep, SettingsDep
from app.sites.actions import site_for
from app.webhooks import actions, service
from app.webhooks.schemas import DeliveryOut, SecretOut, WebhookIn, WebhookOut, WebhookPatch

router = APIRouter(tags=["webhooks"], route_class=IdempotentRoute)
secrets = APIRouter()
Administrator = Annotated[Access, allowed(Scope.ADMIN)]


@router.get("/sites/{site_id:int}/webhooks")
def list_webhooks(site_id: int, session: SessionDep, access: Administrator) -> Page[WebhookOut]:
    """List a site's webhooks."""
    site = site_for(session, access, Scope.ADMIN, site_id)
    return Page(items=[WebhookOut.of(row) for row in service.of_site(session, site.id)])


@secrets.post("/sites/{site_id:int}/webhooks", status_code=201)
def add_webhook(
    site_id: int,
    data: WebhookIn,
    database: DatabaseDep,
    session: SessionDep,
    settings: SettingsDep,
    access: Administrator,
    response: Response,
) -> SecretOut:
    """Have a site's ended runs and exports told to an address; the secret is shown this once.

    Deliveries are signed as the Standard Webhooks specification says: `webhook-signature` is `v1,`
    and the Base64 of HMAC-SHA256 over `webhook-id`, `webhook-timestamp` and the body, joined by
    dots. Addresses inside this installation's network are refused (422) unless their network is
    allowed.
    """
    actions.check_new(database, settings, access, site_id, data.url)
    webhook = actions.add(session, access, site_id, data)
    set_etag(response, webhook.version)
    response.headers["Location"] = f"/api/v1/webhooks/{webhook.id}"
    return SecretOut.of(webhook)


@router.get("/webhooks/{webhook_id:int}")
def get_webhook(
    webhook_id: int, session: SessionDep, access: Administrator, response: Response
) -> WebhookOut:
    """Show a webhook; its ETag is what an edit sends as If-Match."""
    webhook = actions.webhook_for(session, access, webhook_id)
    set_etag(response, webhook.version)
    return WebhookOut.of(webhook)


@router.patch("/webhooks/{webhook_id:int}", dependencies=[VERSIONED])
def update_webhook(
    webhook_id: int,
    data: WebhookPatch,
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    settings: SettingsDep,
    access: Administrator,
    response: Response,
) -> WebhookOut:
    """Change a webhook; fields left out stay. `enabled` starts and stops it."""
    actions.check_change(database, settings, access, webhook_id, data.url)
    webhook = actions.webhook_for(session, access, webhook_id)
    check_if_match(request, webhook.version)
    actions.update(session, access, webhook, data)
    set_etag(response, webhook.version)
    return WebhookOut.of(webhook)


@router.delete("/webhooks/{webhook_id:int}", status_code=204, dependencies=[VERSIONED])
def remove_webhook(
    webhook_id: int, request: Request, session: SessionDep, access: Administrator
) -> None:
    """Remove a webhook with its deliveries."""
    webhook = actions.webhook_for(session, access, webhook_id)
    heed_if_match(request, webhook.version)
    actions.remove(session, access, webhook)


@secrets.post("/webhooks/{webhook_id:int}/rotate")
def rotate_webhook_secret(webhook_id: int, session: SessionDep, access: Administrator) -> SecretOut:
    """Make a new secret, shown this once; for a day the old one signs, too."""
    webhook = actions.webhook_for(session, access, webhook_id)
    return SecretOut.of(actions.rotate(session, access, webhook))


@router.post("/webhooks/{webhook_id:int}/test", status_code=202)
def test_webhook(webhook_id: int, session: SessionDep, access: Administrator) -> DeliveryOut:
    """Send a delivery `test`."""
    webhook = actions.webhook_for(session, access, webhook_id)
    return DeliveryOut.of(actions.send_test(session, access, webhook))


@router.get("/webhooks/{webhook_id:int}/deliveries")
def list_deliveries(
    webhook_id: int, session: SessionDep, access: Administrator, paging: PagingDep
) -> Page[DeliveryOut]:
    """List a webhook's deliveries and how they went, oldest first."""
    webhook = actions.webhook_for(session, access, webhook_id)
    rows, cursor = service.deliveries(session, webhook.id, paging)
    return Page(items=[DeliveryOut.of(row) for row in rows], next_cursor=cursor)


@router.post("/webhook-deliveries/{delivery_id:int}/resend", status_code=202)
def resend_delivery(delivery_id: int, session: SessionDep, access: Administrator) -> DeliveryOut:
    """Send a delivery that has ended once more, under the same id."""
    return DeliveryOut.of(actions.send_again(session, access, delivery_id))


router.include_router(secrets)
