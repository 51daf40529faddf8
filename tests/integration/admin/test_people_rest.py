"""Administrators look after people by REST: invite, reset, hand over, sign out, unlink."""

from collections.abc import Callable
from urllib.parse import urlsplit

import sqlalchemy as sa
from starlette.testclient import TestClient

from app.auth.totp import new_secret
from app.db import Database
from app.tables.identity import AuditEntry, ProviderIdentity, Role, User
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser

PASSWORD = "four words easily kept"


def follow(browser: TestClient, url: str) -> int:
    """Follow a link with its form; returns the status."""
    token = urlsplit(url).query.partition("token=")[2]
    return browser.post("/join", data={"token": token, "password": PASSWORD}).status_code


def test_people_are_invited_and_invitations_withdrawn(
    client: TestClient, anonymous_browser: TestClient, database: Database
) -> None:
    """The link is told once and works; a withdrawn one does not; mail needs a server."""
    with database.writing() as session:
        site_id = make_site(session).id
    wanted = {"email": "ada@harbour.example", "role": "operator", "site_id": site_id}
    first, second = (client.post("/api/v1/invitations", json=wanted) for _ in range(2))
    assert (first.status_code, first.json()["url"][:7]) == (201, "http://")
    listed = client.get("/api/v1/invitations").json()["items"]
    assert [item["id"] for item in listed] == [second.json()["id"], first.json()["id"]]
    assert "url" not in listed[0]
    assert client.delete(f"/api/v1/invitations/{second.json()['id']}").status_code == 204
    assert follow(anonymous_browser, second.json()["url"]) == 404
    assert follow(anonymous_browser, first.json()["url"]) == 303
    roles = client.get("/api/v1/users").json()["items"][-1]["memberships"]
    assert roles == [{"role": "operator", "site_id": site_id}]
    mailed = client.post("/api/v1/invitations", json=wanted | {"by_mail": True})
    assert (mailed.status_code, mailed.json()["errors"][0]["field"]) == (422, "by_mail")


def test_a_password_is_reset_and_browsers_are_signed_out(
    client: TestClient,
    make_user: MakeUser,
    browser_of: Callable[[User], TestClient],
    anonymous_browser: TestClient,
) -> None:
    """A person's browsers are listed and ended, by an administrator and by themselves."""
    person = make_user(Role.REVIEWER)
    at = f"/api/v1/users/{person.id}"
    browser, other = browser_of(person), browser_of(person)
    listed = browser.get("/api/v1/me/sessions").json()["items"]
    assert sorted(item["is_present"] for item in listed) == [False, True]
    (another,) = (item["id"] for item in listed if not item["is_present"])
    assert browser.delete(f"/api/v1/me/sessions/{another}").status_code == 204
    assert other.get("/account").status_code == 303
    assert len(client.get(f"{at}/sessions").json()["items"]) == 1
    assert client.delete(f"{at}/sessions").status_code == 204
    assert browser.get("/account").status_code == 303
    made = client.post(f"{at}/password-reset", json={})
    assert made.status_code == 201
    assert follow(anonymous_browser, made.json()["url"]) == 303
    sent = {"email": person.email, "password": PASSWORD}
    assert anonymous_browser.post("/sign-in", data=sent).headers["location"] == "/"


def test_second_factor_identity_and_work_are_an_administrators_to_change(
    client: TestClient, make_user: MakeUser, database: Database
) -> None:
    """Each act is done, told and in the audit log."""
    person, taker = make_user(Role.REVIEWER), make_user(Role.REVIEWER)
    with database.writing() as session:
        session.get_one(User, person.id).totp_secret = new_secret()
        session.add(ProviderIdentity(user_id=person.id, issuer="https://id.example", subject="1"))
    at = f"/api/v1/users/{person.id}"
    assert client.get(at).json()["has_second_factor"] is True
    answers = [
        client.put(
            f"{at}/second-factor",
            json={"wanted": wanted},
            headers={"If-Match": client.get(at).headers["ETag"]},
        ).json()
        for wanted in ("demand", "reset")
    ]
    assert answers == [
        {"is_on": True, "is_demanded": True},
        {"is_on": False, "is_demanded": True},
    ]
    assert client.get(at).json()["owes_second_factor"] is True
    handed = client.post(f"{at}/hand-over", json={"taker_id": taker.id})
    assert handed.json() == {"items": 0}
    assert client.post(f"{at}/hand-over", json={"taker_id": 999}).status_code == 404
    statuses = [client.delete(f"{at}/identity").status_code for _ in range(2)]
    assert statuses == [204, 409]
    with database.reading() as session:
        acts = session.scalars(sa.select(AuditEntry.action).order_by(AuditEntry.id)).all()
    assert acts == ["demand", "reset", "hand over", "unlink"]
