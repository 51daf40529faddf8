"""Webhooks: what ends is told, signed, to allowed addresses, and tried until it is taken."""

import base64
import hashlib
import hmac
import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database, now
from app.exports import service as exports
from app.runs import batch_repository as batches
from app.tables.identity import AuditEntry, User
from app.tables.runs import RunStatus
from app.tables.webhooks import WebhookDelivery
from app.webhooks import service
from tests.factories.world import make_world
from worker.leases import Leases
from worker.webhooks import WebhookLoops

LOCAL = ["127.0.0.0/8"]


@dataclass
class Receiver:
    """A program that takes deliveries, or fails at it as it is told."""

    answer: int = 200
    location: str = ""
    stalls: bool = False
    taken: list[tuple[dict[str, str], bytes]] = field(default_factory=list)
    url: str = ""
    leaving: threading.Event = field(default_factory=threading.Event)


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    """Give a real HTTP server on this machine."""
    state = Receiver()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            state.taken.append(({k.lower(): v for k, v in self.headers.items()}, body))
            if state.stalls:
                with suppress(OSError):  # whoever listened has left
                    while not state.leaving.wait(0.1):  # never long enough for a read to fail
                        self.wfile.write(b"H")
                return
            self.send_response(state.answer)
            if state.location:
                self.send_header("Location", state.location)
            self.end_headers()

        def log_message(self, *_: object) -> None: ...

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    state.url = f"http://127.0.0.1:{server.server_port}/hook"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield state
    state.leaving.set()
    server.shutdown()
    server.server_close()


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Allow receivers on this machine; try twice, and wait for none long."""
    changes = {
        "webhook_allowed_networks": LOCAL,
        "webhook_pauses_s": [0.0],
        "webhook_timeout_s": 0.5,
    }
    return settings.model_copy(update=changes)


@pytest.fixture
def ids(database: Database) -> dict[str, int]:
    """Give a site with one of everything, and no webhook."""
    with database.writing() as session:
        made = make_world(session, "Elbe", 211000001)
        session.execute(sa.text("DELETE FROM webhooks"))
    return made


def send_due(database: Database, settings: Settings, webhook_id: int) -> WebhookDelivery | None:
    """Do what a worker's loop does once; returns the delivery as it stands then."""
    with database.reading() as session:
        found = service.due(session, webhook_id)
    if found is None:
        return None
    outcome = service.attempt(settings, *found)
    with database.writing() as session:
        service.settle(session, settings, found[1].id, outcome)
    with database.reading() as session:
        return service.get_delivery(session, found[1].id)


def add(client: TestClient, site_id: int, url: str) -> dict[str, Any]:
    """Add a webhook by REST."""
    answer = client.post(f"/api/v1/sites/{site_id}/webhooks", json={"url": url})
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    return made


def is_signed(taken: tuple[dict[str, str], bytes], secret: str) -> bool:
    """Whether one of the signatures is right, computed as a receiver would."""
    headers, body = taken
    key = base64.b64decode(secret.removeprefix("whsec_"))
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    right = "v1," + base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
    return right in headers["webhook-signature"].split()


def test_an_ended_run_and_export_are_told_signed(
    client: TestClient,
    database: Database,
    settings: Settings,
    receiver: Receiver,
    ids: dict[str, int],
) -> None:
    """The end and its delivery are one transaction; the body is signed, and ends are told once."""
    made = add(client, ids["site_id"], receiver.url)
    shown = client.get(f"/api/v1/webhooks/{made['id']}").json()
    assert "secret" not in shown
    with database.writing() as session:
        batches.finish(session, ids["run_id"], RunStatus.SUCCEEDED)
        session.rollback()
    assert send_due(database, settings, made["id"]) is None
    with database.writing() as session:
        batches.finish(session, ids["run_id"], RunStatus.SUCCEEDED)
        batches.finish(session, ids["run_id"], RunStatus.FAILED, "ended already")
        exports.fail(session, ids["export_id"], "no such camera")
    for _ in range(2):
        delivery = send_due(database, settings, made["id"])
        assert delivery is not None
        assert (delivery.status, delivery.answer_status) == ("delivered", 200)
    assert send_due(database, settings, made["id"]) is None
    told = [json.loads(body) for _, body in receiver.taken]
    assert [(one["type"], one["data"]["status"]) for one in told] == [
        ("run.finished", "succeeded"),
        ("export.finished", "failed"),
    ]
    assert all(is_signed(one, made["secret"]) for one in receiver.taken)


def test_a_failing_receiver_is_tried_again_then_given_up_and_can_be_sent_to_again(
    client: TestClient,
    database: Database,
    settings: Settings,
    receiver: Receiver,
    ids: dict[str, int],
) -> None:
    """Errors, silence and redirects fail with their reason, so many times and no more."""
    made = add(client, ids["site_id"], receiver.url)
    test = f"/api/v1/webhooks/{made['id']}/test"
    delivery_id = client.post(test).json()["id"]
    receiver.answer = 500
    first = send_due(database, settings, made["id"])
    receiver.answer, receiver.location = 302, receiver.url
    second = send_due(database, settings, made["id"])
    assert first is not None
    assert second is not None
    assert (first.status, first.error) == ("waiting", "answers 500")
    assert (second.status, second.attempts) == ("failed", 2)
    assert second.error == "answers 302; redirects are not followed"
    assert len(receiver.taken) == 2
    receiver.answer, receiver.location, receiver.stalls = 200, "", True
    again = f"/api/v1/webhook-deliveries/{delivery_id}/resend"
    assert client.post(again).status_code == 202
    assert client.post(again).status_code == 409
    stalled = send_due(database, settings, made["id"])
    assert stalled is not None
    assert stalled.answer_status is None
    assert stalled.error == "has not answered within 0.5 s"
    receiver.stalls = False
    delivered = send_due(database, settings, made["id"])
    assert delivered is not None
    assert delivered.status == "delivered"
    assert {headers["webhook-id"] for headers, _ in receiver.taken} == {f"dlv_{delivery_id}"}
    listed = client.get(f"/api/v1/webhooks/{made['id']}/deliveries").json()["items"]
    assert [one["status"] for one in listed] == ["delivered"]


def test_a_worker_sends_what_is_due(
    client: TestClient,
    database: Database,
    settings: Settings,
    receiver: Receiver,
    ids: dict[str, int],
) -> None:
    """The loop under its lease sends, stores how it went, and ends when told to."""
    made = add(client, ids["site_id"], receiver.url)
    client.post(f"/api/v1/webhooks/{made['id']}/test")
    quick = settings.model_copy(update={"webhook_look_every_s": 0.05})
    loops = WebhookLoops(database, quick)
    with database.reading() as session:
        assert loops.wanted(session) == {made["id"]: 1}
    lease = Leases(database, quick, "worker").take("webhook")
    assert lease is not None
    stop = threading.Event()
    loop = threading.Thread(target=loops.run, args=(made["id"], lease, stop))
    loop.start()
    here = f"/api/v1/webhooks/{made['id']}/deliveries"
    try:
        for _ in range(600):
            if client.get(here).json()["items"][0]["status"] == "delivered":
                break
            time.sleep(0.1)
    finally:
        stop.set()
        loop.join(60)
    assert not loop.is_alive()
    assert client.get(here).json()["items"][0]["status"] == "delivered"
    assert len(receiver.taken) == 1


def test_a_name_that_leads_inside_later_is_not_connected_to(
    client: TestClient,
    database: Database,
    settings: Settings,
    receiver: Receiver,
    ids: dict[str, int],
) -> None:
    """Addresses are judged at each try: what was allowed when it was stored may be so no more."""
    made = add(client, ids["site_id"], receiver.url)
    client.post(f"/api/v1/webhooks/{made['id']}/test")
    strict = settings.model_copy(update={"webhook_allowed_networks": ["192.0.2.0/24"]})
    refused = send_due(database, strict, made["id"])
    assert refused is not None
    assert "127.0.0.1" in str(refused.error)
    assert "QUAYMARK_WEBHOOK_ALLOWED_NETWORKS" in str(refused.error)
    assert receiver.taken == []


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # no SQL is asked here
@pytest.mark.parametrize(
    "url",
    [
        "http://10.0.0.1/hook",
        "https://169.254.169.254/latest/meta-data",
        "https://[::1]/",
        "https://2130706433.invalid/",
        "ftp://example.org/",
        "https://user:word@example.org/",
        "https://example.org:0/",
        "https://exa mple.org/",
        "javascript:alert(1)",
    ],
)
def test_addresses_inside_and_what_is_no_address_are_refused(
    client: TestClient, ids: dict[str, int], url: str
) -> None:
    """422 names the field, and nothing is stored."""
    here = f"/api/v1/sites/{ids['site_id']}/webhooks"
    answer = client.post(here, json={"url": url})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "url"
    assert client.get(here).json()["items"] == []


def test_a_new_secret_signs_beside_the_old_one_for_a_day(
    client: TestClient,
    database: Database,
    settings: Settings,
    receiver: Receiver,
    ids: dict[str, int],
) -> None:
    """Receivers have a day to take the new secret; after it only that one signs."""
    made = add(client, ids["site_id"], receiver.url)
    fresh = client.post(f"/api/v1/webhooks/{made['id']}/rotate").json()["secret"]
    client.post(f"/api/v1/webhooks/{made['id']}/test")
    send_due(database, settings, made["id"])
    assert is_signed(receiver.taken[0], made["secret"])
    assert is_signed(receiver.taken[0], fresh)
    with database.writing() as session:
        webhook = service.get_webhook(session, made["id"])
        webhook.old_secret_until = now() - timedelta(seconds=1)
        service.test(session, webhook)
    send_due(database, settings, made["id"])
    assert not is_signed(receiver.taken[1], made["secret"])
    assert is_signed(receiver.taken[1], fresh)


def test_people_set_webhooks_up_on_a_page(
    browser_of: Callable[[User], TestClient],
    admin: User,
    database: Database,
    receiver: Receiver,
    ids: dict[str, int],
) -> None:
    """The secret is on the page once; events, test, switch and remove are there, and audited."""
    browser = browser_of(admin)
    here = f"/sites/{ids['site_id']}/webhooks"
    assert "No webhook yet" in browser.get(here).text
    runs, exports = {"event-run.finished": "true"}, {"event-export.finished": "true"}
    deaf = browser.post(here, data={"url": receiver.url})
    assert deaf.status_code == 422
    assert "events" in deaf.text
    wrong = browser.post(here, data={"url": "https://[::1]/"} | runs)
    assert wrong.status_code == 422
    assert "lies inside" in wrong.text
    made = browser.post(here, data={"url": receiver.url} | runs)
    assert "whsec_" in made.text
    shown = browser.get(here).text
    assert receiver.url in shown
    assert "whsec_" not in shown
    number = shown.partition('action="/webhooks/')[2].partition("/")[0]
    assert browser.post(f"/webhooks/{number}/events", data={}).status_code == 422
    assert browser.post(f"/webhooks/{number}/events", data=exports).status_code == 303
    with database.reading() as session:
        assert service.get_webhook(session, int(number)).events == ["export.finished"]
    for act in ("test", "off", "on", "remove"):
        assert browser.post(f"/webhooks/{number}/{act}").status_code == 303
    with database.reading() as session:
        acts = session.scalars(
            sa.select(AuditEntry.action).where(AuditEntry.entity == "webhook").order_by("id")
        ).all()
    assert acts == ["create", "update", "test", "update", "update", "delete"]
    assert "No webhook yet" in browser.get(here).text
