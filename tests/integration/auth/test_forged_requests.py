"""Requests that another site's page makes a signed-in browser send, and other disguises."""

from collections.abc import Callable

import sqlalchemy as sa
from starlette.testclient import TestClient

from app.auth.authentication import SESSION_COOKIE
from app.db import Database
from app.tables.identity import ApiToken, User

BrowserOf = Callable[[User], TestClient]
TOKEN = {"name": "forged", "scopes": ["read"]}


FORGED = [
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Sec-Fetch-Site": "cross-site", "Origin": "http://testserver"},
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://testserver.evil.example"},
    {"Origin": "http://testserver:8080"},
]


def test_a_cross_site_write_is_refused(
    browser_of: BrowserOf, admin: User, database: Database
) -> None:
    """A cookie does not vouch for what another site's page sends; nothing is stored."""
    browser = browser_of(admin)
    del browser.headers["Sec-Fetch-Site"]
    for headers in FORGED:
        assert browser.post("/api/v1/tokens", json=TOKEN, headers=headers).status_code == 403
        assert browser.post("/account/tokens", data=TOKEN, headers=headers).status_code == 403
        assert browser.post("/sign-out", headers=headers).status_code == 403
    with database.reading() as session:
        assert session.scalars(sa.select(ApiToken)).all() == []


OUR_OWN = [
    {"Sec-Fetch-Site": "same-origin"},
    {"Sec-Fetch-Site": "none"},
    {"Origin": "http://testserver"},
    {},
]


def test_our_own_pages_may_write(browser_of: BrowserOf, admin: User) -> None:
    """The same request from our own page, or from a client that is no browser, goes through."""
    browser = browser_of(admin)
    del browser.headers["Sec-Fetch-Site"]
    for headers in OUR_OWN:
        assert browser.post("/api/v1/tokens", json=TOKEN, headers=headers).status_code == 201


def test_a_cross_site_sign_in_is_refused(anonymous: TestClient, admin: User) -> None:
    """Nobody is signed in to a stranger's account behind their back."""
    form = {"email": admin.email, "password": "correct horse battery"}
    answer = anonymous.post("/sign-in", data=form, headers={"Sec-Fetch-Site": "cross-site"})
    assert answer.status_code == 403
    assert SESSION_COOKIE not in answer.cookies


def test_a_bearer_token_needs_no_origin(client: TestClient) -> None:
    """A page elsewhere that holds a token was given it; the check is for cookies."""
    headers = {"Origin": "https://dashboard.example", "Sec-Fetch-Site": "cross-site"}
    assert client.post("/api/v1/tokens", json=TOKEN, headers=headers).status_code == 201


def test_an_empty_authorization_header_does_not_open_the_cookie(
    browser_of: BrowserOf, admin: User
) -> None:
    """The check is skipped for a token, so with a token header the cookie does not count."""
    answer = browser_of(admin).post(
        "/api/v1/tokens",
        json=TOKEN,
        headers={"Authorization": "Bearer x", "Sec-Fetch-Site": "cross-site"},
    )
    assert answer.status_code == 401


def test_json_in_disguise_is_refused(client: TestClient) -> None:
    """JSON under a type that forms can send is not read as JSON."""
    for content_type in ("text/plain", "application/x-www-form-urlencoded", ""):
        answer = client.post(
            "/api/v1/tokens",
            content=b'{"name": "forged", "scopes": ["read"]}',
            headers={"Content-Type": content_type},
        )
        assert answer.status_code == 422
        assert answer.headers["content-type"] == "application/problem+json"


def test_no_get_writes(client: TestClient) -> None:
    """What writes has no GET, so that a link or an image cannot do it."""
    for path in ("/sign-out", "/account/tokens", "/account/password", "/account/sessions/end"):
        answer = client.get(path)
        assert answer.status_code == 405
        assert answer.headers["allow"] == "POST"
