"""API tokens: scoped, expiring, revocable, shown once, and never more than their maker."""

from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database
from app.tables.identity import ApiToken, AuditEntry, User
from tests.factories import identity

ClientOf = Callable[..., TestClient]
MakeUser = Callable[..., User]


def _with(app: FastAPI, token: str) -> TestClient:
    return TestClient(app, headers={"Authorization": f"Bearer {token}"})


def test_a_token_is_shown_once_and_works(
    app: FastAPI, client: TestClient, database: Database
) -> None:
    """The answer holds the text, the database only its hash, and the text opens the door."""
    made = client.post("/api/v1/tokens", json={"name": "nightly", "scopes": ["read", "export"]})
    assert made.status_code == 201
    text = made.json()["token"]
    with database.reading() as session:
        rows = session.execute(sa.select(ApiToken.__table__)).all()
        assert text not in str(rows)
        assert "nightly" in str(session.scalars(sa.select(AuditEntry.details)).all())
    assert text not in client.get("/api/v1/tokens").text
    me = _with(app, text).get("/api/v1/me").json()
    assert me["scopes"] == ["export", "read"]
    assert me["is_admin"] is False


def test_a_token_narrows_its_owners_role(client_of: ClientOf, make_user: MakeUser) -> None:
    """An administrator's token without the scope `admin` does not administer."""
    reader = client_of(make_user("admin"), Scope.READ)
    assert reader.get("/api/v1/users").status_code == 403
    assert reader.get("/api/v1/sites").status_code == 200


def test_a_token_adds_nothing_to_its_owners_role(client_of: ClientOf, make_user: MakeUser) -> None:
    """A viewer's token with every scope stays a viewer's."""
    viewer = client_of(make_user("viewer"), *Scope)
    assert viewer.get("/api/v1/me").json()["scopes"] == ["export", "read"]
    assert viewer.get("/api/v1/users").status_code == 403


def test_a_token_never_widens_its_scopes(client_of: ClientOf, make_user: MakeUser) -> None:
    """A token makes tokens within its own scopes; more is forbidden and makes nothing."""
    reader = client_of(make_user("admin"), Scope.READ, Scope.EXPORT)
    assert reader.post("/api/v1/tokens", json={"scopes": ["read", "admin"]}).status_code == 403
    assert reader.post("/api/v1/tokens", json={"scopes": ["read"]}).status_code == 201


def test_a_token_outlives_neither_its_makers_time_nor_its_revocation(client: TestClient) -> None:
    """A token that a token made, and what that one made, end with the first."""
    longer = client.post("/api/v1/tokens", json={"scopes": ["read"], "expires_days": 3650})
    assert (longer.status_code, "lives no longer" in longer.json()["detail"]) == (403, True)
    first = client.post("/api/v1/tokens", json={"scopes": ["read"]}).json()
    made, headers = first, {}
    for asked in ({}, {"expires_days": 1}):
        headers = {"Authorization": f"Bearer {made['token']}"}
        body = {"scopes": ["read"], **asked}
        made = client.post("/api/v1/tokens", json=body, headers=headers).json()
        assert made["expires_at"] == first["expires_at"]
    assert client.get("/api/v1/me", headers=headers).status_code == 200
    client.delete(f"/api/v1/tokens/{first['id']}")
    assert client.get("/api/v1/me", headers=headers).status_code == 401


def test_expired_and_revoked_tokens_are_nobody(
    app: FastAPI, client: TestClient, admin: User, database: Database
) -> None:
    """A token ends when its time is up and when it is revoked."""
    with database.writing() as session:
        expired = identity.make_token(session, admin, lives=timedelta(seconds=-1))
    assert _with(app, expired).get("/api/v1/me").status_code == 401
    made = client.post("/api/v1/tokens", json={"scopes": ["read"]}).json()
    fresh = _with(app, made["token"])
    assert fresh.get("/api/v1/me").status_code == 200
    assert client.delete(f"/api/v1/tokens/{made['id']}").status_code == 204
    assert fresh.get("/api/v1/me").status_code == 401


def test_foreign_tokens_are_hidden(client_of: ClientOf, make_user: MakeUser) -> None:
    """Another's token is neither listed nor revoked; an administrator may do both."""
    mine, theirs = client_of(make_user("viewer")), client_of(make_user("viewer"))
    identifier = mine.get("/api/v1/tokens").json()["items"][0]["id"]
    assert identifier not in [part["id"] for part in theirs.get("/api/v1/tokens").json()["items"]]
    foreign, unknown = (theirs.delete(f"/api/v1/tokens/{i}") for i in (identifier, 999_999))
    assert foreign.status_code == unknown.status_code == 404
    assert foreign.json() == unknown.json()
    assert theirs.get("/api/v1/tokens?everybody=true").status_code == 403
    admin = client_of(make_user("admin"))
    listed = admin.get("/api/v1/tokens?everybody=true").json()["items"]
    assert identifier in [part["id"] for part in listed]
    assert admin.delete(f"/api/v1/tokens/{identifier}").status_code == 204


def test_what_the_owner_loses_the_token_loses(
    client: TestClient, client_of: ClientOf, make_user: MakeUser
) -> None:
    """Roles are read at every request, so a demotion reaches tokens at once."""
    user = make_user("operator")
    token = client_of(user)
    assert "ingest" in token.get("/api/v1/me").json()["scopes"]
    change = {"memberships": [{"role": "viewer"}]}
    answer = client.patch(f"/api/v1/users/{user.id}", json=change, headers={"If-Match": '"1"'})
    assert answer.status_code == 200
    assert token.get("/api/v1/me").json()["scopes"] == ["export", "read"]


def test_wrong_credentials_are_a_problem(anonymous: TestClient) -> None:
    """Nonsense in the Authorization header is 401 with the way to mend it, never 500."""
    for header in ("Bearer nonsense", "Bearer", "Basic YTpi", "Bearer " + "x" * 3000, "\xff"):
        answer = anonymous.get("/api/v1/me", headers={"Authorization": header.encode("latin-1")})
        assert answer.status_code == 401
        assert answer.headers["www-authenticate"].startswith("Bearer")
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_tokens_use_is_noted(client: TestClient) -> None:
    """The list tells which tokens are still in use."""
    used = client.get("/api/v1/tokens").json()["items"][0]["last_used_at"]
    assert used is not None
    assert used.endswith("Z")


def test_tokens_are_made_and_revoked_on_the_account_page(
    browser_of: Callable[[User], TestClient], admin: User
) -> None:
    """The text is on the page that answers the form, and on no later one."""
    browser = browser_of(admin)
    made = browser.post("/account/tokens", data={"name": "mine", "scopes": ["read"], "days": "1"})
    assert "<pre>qm_" in made.text
    shown = browser.get("/account").text
    assert "<pre>qm_" not in shown
    assert "mine" in shown
    refused = browser.post("/account/tokens", data={"name": "none", "days": "1"})
    assert refused.status_code == 422
    assert "name at least one" in refused.text
    identifier = shown.partition("/account/tokens/")[2].partition("/revoke")[0]
    assert browser.post(f"/account/tokens/{identifier}/revoke").status_code == 303
    assert "mine" not in browser.get("/account").text
