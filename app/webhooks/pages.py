"""The page of a site's webhooks."""

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep, SettingsDep
from app.errors import Invalid
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.sites.actions import site_for
from app.tables.webhooks import Webhook, WebhookEvent
from app.templating import page
from app.webhooks import actions, service
from app.webhooks.schemas import WebhookIn, WebhookPatch

router = APIRouter()
EVENT = "event-"  # a checkbox each; what is chosen comes under names of its own
EVENTS = [(WebhookEvent.RUN_FINISHED, "Runs"), (WebhookEvent.EXPORT_FINISHED, "Exports")]
Administrator = Annotated[Access, allowed(Scope.ADMIN)]


@router.get("/sites/{site_id:int}/webhooks")
def show_webhooks(
    request: Request, site_id: int, session: SessionDep, access: Administrator
) -> Response:
    """Show a site's webhooks and how the newest deliveries went."""
    return _webhooks_page(request, session, access, site_id, Form())


@router.post("/sites/{site_id:int}/webhooks")
def add_webhook(
    request: Request,
    site_id: int,
    database: DatabaseDep,
    settings: SettingsDep,
    access: Administrator,
    entered: Submitted,
) -> Response:
    """Add a webhook and show its secret this once."""
    try:
        data = parse(WebhookIn, _with_events(entered))
        actions.check_new(database, settings, access, site_id, data.url)
        with database.writing() as session:
            secret = actions.add(session, access, site_id, data).secret
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            form = rejected(entered, error)
            return _webhooks_page(request, session, access, site_id, form, status=error.status)
    with database.reading() as session:
        return _webhooks_page(request, session, access, site_id, Form(), secret=secret)


@router.post("/webhooks/{webhook_id:int}/events")
def choose_events(
    request: Request,
    webhook_id: int,
    session: SessionDep,
    access: Administrator,
    entered: Submitted,
) -> Response:
    """Choose what a webhook hears of."""
    webhook = actions.webhook_for(session, access, webhook_id)
    try:
        data = parse(WebhookPatch, {"events": _chosen(entered)})
    except Invalid:
        form = Form(message="Choose at least one event, or switch the webhook off.")
        return _webhooks_page(request, session, access, webhook.site_id, form, status=422)
    return _back(actions.update(session, access, webhook, data))


@router.post("/webhooks/{webhook_id:int}/rotate")
def rotate_secret(
    request: Request, webhook_id: int, database: DatabaseDep, access: Administrator
) -> Response:
    """Make a new secret and show it this once."""
    with database.writing() as session:
        webhook = actions.rotate(session, access, actions.webhook_for(session, access, webhook_id))
        site_id, secret = webhook.site_id, webhook.secret
    with database.reading() as session:
        return _webhooks_page(request, session, access, site_id, Form(), secret=secret)


@router.post("/webhooks/{webhook_id:int}/on")
def switch_on(webhook_id: int, session: SessionDep, access: Administrator) -> Response:
    """Switch a webhook on; what waits is sent."""
    return _switched(session, access, webhook_id, enabled=True)


@router.post("/webhooks/{webhook_id:int}/off")
def switch_off(webhook_id: int, session: SessionDep, access: Administrator) -> Response:
    """Switch a webhook off; what waits goes on waiting."""
    return _switched(session, access, webhook_id, enabled=False)


@router.post("/webhooks/{webhook_id:int}/test")
def send_test(webhook_id: int, session: SessionDep, access: Administrator) -> Response:
    """Send a test delivery."""
    webhook = actions.webhook_for(session, access, webhook_id)
    actions.send_test(session, access, webhook)
    return _back(webhook)


@router.post("/webhooks/{webhook_id:int}/remove")
def remove_webhook(webhook_id: int, session: SessionDep, access: Administrator) -> Response:
    """Remove a webhook with its deliveries."""
    webhook = actions.webhook_for(session, access, webhook_id)
    actions.remove(session, access, webhook)
    return _back(webhook)


@router.post("/webhook-deliveries/{delivery_id:int}/resend")
def send_again(delivery_id: int, session: SessionDep, access: Administrator) -> Response:
    """Send a delivery that has ended once more."""
    delivery = actions.send_again(session, access, delivery_id)
    return _back(service.get_webhook(session, delivery.webhook_id))


def _with_events(entered: Mapping[str, str]) -> dict[str, Any]:
    others = {name: value for name, value in entered.items() if not name.startswith(EVENT)}
    return {**others, "events": _chosen(entered)}


def _chosen(entered: Mapping[str, str]) -> list[str]:
    return [name.removeprefix(EVENT) for name in entered if name.startswith(EVENT)]


def _switched(session: SessionDep, access: Access, webhook_id: int, *, enabled: bool) -> Response:
    webhook = actions.webhook_for(session, access, webhook_id)
    return _back(actions.update(session, access, webhook, WebhookPatch(enabled=enabled)))


def _back(webhook: Webhook) -> Response:
    return RedirectResponse(f"/sites/{webhook.site_id}/webhooks", status_code=303)


def _webhooks_page(
    request: Request,
    session: SessionDep,
    access: Access,
    site_id: int,
    form: Form,
    *,
    secret: str = "",
    status: int = 200,
) -> Response:
    site = site_for(session, access, Scope.ADMIN, site_id)
    webhooks = service.of_site(session, site.id)
    return page(
        request,
        "webhooks/list.html",
        status_code=status,
        crumbs=[{"label": site.name, "href": f"/sites/{site.id}"}, {"label": "Webhooks"}],
        site=site,
        webhooks=webhooks,
        urls={webhook.id: webhook.url for webhook in webhooks},
        deliveries=service.newest_deliveries(session, webhooks),
        secret=secret,
        form=form,
        events=EVENTS,
    )
