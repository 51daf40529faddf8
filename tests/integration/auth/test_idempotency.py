"""A write repeated with its key happens once."""

from collections.abc import Callable

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.auth import idempotency
from app.db import Database
from app.tables.identity import IdempotencyKey, User

KEY = {"Idempotency-Key": "abc"}
BODY = {"email": "ada@harbour.example", "password": "correct horse battery"}


def test_a_repetition_gets_the_first_answer(client: TestClient, database: Database) -> None:
    """The same request with the same key makes one person and is answered alike."""
    first = client.post("/api/v1/users", json=BODY, headers=KEY)
    second = client.post("/api/v1/users", json=BODY, headers=KEY)
    assert first.status_code == second.status_code == 201
    assert first.json() == second.json()
    for name in ("location", "etag"):
        assert first.headers[name] == second.headers[name]
    assert second.headers["idempotency-replayed"] == "true"
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(User)) == 2
        assert "correct horse" not in str(
            session.execute(sa.select(IdempotencyKey.__table__)).all()
        )


def test_an_answer_without_a_body_is_repeated(client: TestClient, admin: User) -> None:
    """A deletion repeated with its key is done, not "not found"."""
    made = client.post("/api/v1/users", json=BODY).json()["id"]
    for _ in range(2):
        answer = client.delete(f"/api/v1/users/{made}", headers=KEY)
        assert (answer.status_code, answer.content) == (204, b"")
    assert client.delete(f"/api/v1/users/{made}").status_code == 404
    assert made != admin.id


def test_the_key_with_another_request_is_a_mistake(client: TestClient) -> None:
    """Another body or path under a used key is refused, naming the header."""
    client.post("/api/v1/users", json=BODY, headers=KEY)
    other = client.post("/api/v1/users", json=BODY | {"name": "Ada"}, headers=KEY)
    assert other.status_code == 422
    assert other.json()["errors"][0]["field"] == "Idempotency-Key"
    assert client.delete("/api/v1/users/1", headers=KEY).status_code == 422
    assert (
        client.post("/api/v1/users", json=BODY, headers={"Idempotency-Key": "x" * 201}).status_code
        == 422
    )


def test_a_failure_is_not_kept(client: TestClient) -> None:
    """A refused request may be mended and sent again under its key."""
    bad = client.post(
        "/api/v1/users",
        json=BODY | {"memberships": [{"role": "viewer", "site_id": 9}]},
        headers=KEY,
    )
    assert bad.status_code == 422
    assert client.post("/api/v1/users", json=BODY, headers=KEY).status_code == 201


def test_keys_belong_to_their_caller(
    client: TestClient, client_of: Callable[..., TestClient], make_user: Callable[..., User]
) -> None:
    """Another caller's same key is another key."""
    client.post("/api/v1/users", json=BODY, headers=KEY)
    other = client_of(make_user("admin"))
    answer = other.post("/api/v1/users", json=BODY | {"email": "b@harbour.example"}, headers=KEY)
    assert answer.status_code == 201


def test_two_at_once_make_one(
    client: TestClient, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the first is not stored yet as the second looks, the second changes nothing."""
    client.post("/api/v1/users", json=BODY, headers=KEY)
    monkeypatch.setattr(idempotency, "_earlier_answer", lambda *_: None)
    late = client.post("/api/v1/users", json=BODY | {"email": "b@harbour.example"}, headers=KEY)
    assert late.status_code == 409
    with database.reading() as session:
        emails = session.scalars(sa.select(User.email)).all()
    assert "b@harbour.example" not in emails
