"""Letters from the click to the mailbox: web, job, worker and mail server are all real."""

import re
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest
import sqlalchemy as sa
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database, now
from app.main import furnish
from app.tables.feeds import AisFeed, FeedKind
from app.tables.identity import AuditEntry, Role
from tests.factories import identity
from tests.factories.sites import make_site
from tests.integration.conftest import _cheap_passwords, routes
from tests.mail_server import MailServer
from tests.worker_process import WorkerProcess, wait_until

__all__ = ["_cheap_passwords", "routes"]
PUBLIC = "https://quay.example"
NEW_PASSWORD = "four words easily kept"


@pytest.fixture
def mail_server() -> Iterator[MailServer]:
    """Serve mail."""
    with MailServer() as server:
        yield server


@pytest.fixture
def mailing(settings: Settings, mail_server: MailServer) -> Settings:
    """Give the settings of an installation that sends mail."""
    return settings.model_copy(
        update={
            "public_url": PUBLIC,
            "smtp_host": "127.0.0.1",
            "smtp_port": mail_server.port,
            "smtp_security": "none",
            "smtp_sender": "quay@harbour.example",
        }
    )


def working(settings: Settings, tmp_path: Path) -> WorkerProcess:
    """Start a worker that sends mail."""
    return WorkerProcess(
        settings,
        tmp_path / "worker.log",
        QUAYMARK_PUBLIC_URL=settings.public_url,
        QUAYMARK_SMTP_HOST=settings.smtp_host,
        QUAYMARK_SMTP_PORT=str(settings.smtp_port),
        QUAYMARK_SMTP_SECURITY="none",
        QUAYMARK_SMTP_SENDER=settings.smtp_sender,
        QUAYMARK_SMTP_PAUSES_S="[0.1, 0.1]",
        QUAYMARK_HEARTBEAT_S="0.2",
        QUAYMARK_ALARMS_LOOK_EVERY_S="0.1",
    )


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # a worker takes its time
def test_links_go_by_mail_once_and_for_those_who_are_here(
    routes: FastAPI,
    mailing: Settings,
    database: Database,
    mail_server: MailServer,
    tmp_path: Path,
) -> None:
    """An invitation and a forgotten password work by mail; strangers get the same answer, no mail.

    A server that fails for a moment is tried again; one that refuses for good fails the job, which
    says why and can be tried again. An alarm goes to the administrator by itself.
    """
    with database.writing() as session:
        admin = identity.make_user(session, Role.ADMIN, email="admin@harbour.example")
        eve = identity.make_user(session, Role.REVIEWER, email="eve@harbour.example")
        token = identity.make_token(session, admin)
        cookie = identity.make_login_session(session, admin)
    furnish(routes, mailing)
    browser = TestClient(
        routes,
        headers={"Accept": "text/html", "Sec-Fetch-Site": "same-origin"},
        base_url=PUBLIC,
        follow_redirects=False,
    )
    api = TestClient(routes, headers={"Authorization": f"Bearer {token}"}, base_url=PUBLIC)
    mail_server.refusals = ["451 later", "550 no such person"]
    with browser, working(mailing, tmp_path):
        browser.cookies.set("quaymark_session", cookie)
        invited = {"email": "ada@harbour.example", "role": "reviewer", "by_mail": "true"}
        shown = browser.post("/admin/invitations", data=invited).text
        assert "A mail is on its way" in shown

        def job() -> dict[str, str]:
            newest: dict[str, str] = api.get("/api/v1/jobs").json()["items"][0]
            return newest

        wait_until(lambda: job()["status"] == "failed", what="the refusal")
        assert "550 no such person" in job()["error"]
        assert "550 no such person" in browser.get("/admin/jobs").text
        assert api.post(f"/api/v1/jobs/{job()['id']}/retry").status_code == 200
        wait_until(lambda: bool(mail_server.letters), what="the invitation")

        browser.cookies.clear()
        answers = [
            browser.post("/sign-in/forgotten", data={"email": email})
            for email in ("nobody@harbour.example", eve.email)
        ]
        texts = [re.sub(r"\w+@harbour", "x@harbour", answer.text) for answer in answers]
        assert (answers[0].status_code, texts[0]) == (200, texts[1])
        wait_until(lambda: len(mail_server.letters) == 2, what="the new password's link")
        wait_until(lambda: job()["status"] == "succeeded", what="the last job")

        with database.writing() as session:
            silent = AisFeed(
                site_id=make_site(session).id,
                name="Pier 7",
                kind=FeedKind.TCP,
                host="pier.invalid",
                port=1,
                silent_after_s=60.0,
                started_at=now() - timedelta(hours=1),
            )
            session.add(silent)
        wait_until(lambda: len(mail_server.letters) == 3, what="the alarm")

    assert mail_server.letters.pop()["To"] == admin.email
    assert [letter["To"] for letter in mail_server.letters] == [invited["email"], eve.email]
    for address in (invited["email"], eve.email):
        where, path = mail_server.link_to(address)
        assert (where, browser.get(path).status_code) == (PUBLIC, 200)
        sent = {"token": path.partition("=")[2], "password": NEW_PASSWORD}
        assert [browser.post("/join", data=sent).status_code for _ in range(2)] == [303, 404]
        entered = {"email": address, "password": NEW_PASSWORD}
        assert browser.post("/sign-in", data=entered).headers["location"] == "/"
    jobs = api.get("/api/v1/jobs").text
    assert "token" not in jobs
    assert "@" not in jobs
    with database.reading() as session:
        mailed = session.scalars(sa.select(AuditEntry).where(AuditEntry.action == "mail")).all()
    assert [entry.entity for entry in mailed] == ["password_reset"]
