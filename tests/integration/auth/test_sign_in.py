"""Signing in with a password: the cookie, the throttle, where one goes afterwards."""

from collections.abc import Callable
from datetime import timedelta

import httpx2
import pytest
import sqlalchemy as sa
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.auth.authentication import SESSION_COOKIE
from app.auth.tokens import token_sha256
from app.config import Settings
from app.db import Database
from app.main import create_app
from app.tables.identity import LoginSession, User
from tests.factories import identity

WRONG = "the wrong password"


def _post(
    browser: TestClient, email: str, password: str = identity.PASSWORD, **fields: str
) -> httpx2.Response:
    return browser.post("/sign-in", data={"email": email, "password": password, **fields})


def test_the_right_password_opens_a_session(
    anonymous_browser: TestClient, admin: User, database: Database
) -> None:
    """The cookie is out of scripts' reach and only its SHA-256 is stored."""
    answer = _post(anonymous_browser, admin.email.upper(), next="/admin/users")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/admin/users"
    flags = answer.headers["set-cookie"]
    assert "HttpOnly" in flags
    assert "SameSite=lax" in flags
    cookie = answer.cookies[SESSION_COOKIE]
    with database.reading() as session:
        stored = session.scalars(sa.select(LoginSession)).one()
    assert stored.token_sha256 == token_sha256(cookie)
    assert cookie not in str(vars(stored))
    assert anonymous_browser.get("/account").status_code == 200


def test_the_cookie_is_secure_over_https(settings: Settings, admin: User) -> None:
    """An installation whose public address is https never sends the cookie in the clear."""
    app = create_app(Settings(**settings.model_dump() | {"public_url": "https://quay.example"}))
    with TestClient(app, follow_redirects=False) as browser:
        answer = _post(browser, admin.email)
    assert "Secure" in answer.headers["set-cookie"]
    assert "max-age" in answer.headers["strict-transport-security"]


def test_signing_in_changes_the_cookie_and_ends_the_old_session(
    anonymous_browser: TestClient, admin: User, database: Database
) -> None:
    """A cookie planted before the sign-in is worth nothing after it."""
    first = _post(anonymous_browser, admin.email).cookies[SESSION_COOKIE]
    second = _post(anonymous_browser, admin.email).cookies[SESSION_COOKIE]
    assert first != second
    with database.reading() as session:
        stored = session.scalars(sa.select(LoginSession.token_sha256)).all()
    assert stored == [token_sha256(second)]


def test_signing_out_ends_the_session(
    browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """After signing out the cookie is worth nothing."""
    browser = browser_of(admin)
    cookie = browser.cookies[SESSION_COOKIE]
    assert browser.post("/sign-out").headers["location"] == "/sign-in"
    browser.cookies.set(SESSION_COOKIE, cookie)
    assert browser.get("/account").status_code == 303
    with database.reading() as session:
        assert session.scalars(sa.select(LoginSession)).all() == []


def test_an_expired_session_is_nobody(
    anonymous_browser: TestClient, admin: User, database: Database
) -> None:
    """A session ends by itself."""
    with database.writing() as session:
        cookie = identity.make_login_session(session, admin, lives=timedelta(seconds=-1))
    anonymous_browser.cookies.set(SESSION_COOKIE, cookie)
    assert anonymous_browser.get("/account").headers["location"] == "/sign-in?next=/account"


def test_an_inactive_person_is_nobody(
    anonymous_browser: TestClient,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
) -> None:
    """Neither the password nor a session of somebody who was shut out is worth anything."""
    user = make_user(is_active=False)
    assert _post(anonymous_browser, user.email).status_code == 401
    assert browser_of(user).get("/account").status_code == 303


def test_unknown_people_get_the_answer_of_a_wrong_password(
    anonymous_browser: TestClient, admin: User
) -> None:
    """Nothing in the answer tells whether an account exists."""
    known = _post(anonymous_browser, admin.email, WRONG)
    unknown = _post(anonymous_browser, "nobody@harbour.example", WRONG)
    assert known.status_code == unknown.status_code == 401
    assert known.text.replace(admin.email, "") == unknown.text.replace("nobody@harbour.example", "")


@pytest.mark.parametrize("known", [True, False])
def test_the_eleventh_failure_for_an_account_is_throttled(
    app: FastAPI, admin: User, *, known: bool
) -> None:
    """After ten failures from anywhere even the right password waits, known account or not."""
    email = admin.email if known else "nobody@harbour.example"
    for attempt in range(10):
        browser = TestClient(app, client=(f"192.0.2.{attempt}", 1), follow_redirects=False)
        assert _post(browser, email, WRONG).status_code == 401
    elsewhere = TestClient(app, client=("198.51.100.1", 1), follow_redirects=False)
    answer = _post(elsewhere, email.upper())
    assert answer.status_code == 429
    assert 0 < int(answer.headers["retry-after"]) <= 300


def test_the_eleventh_failure_from_an_address_is_throttled(
    app: FastAPI, anonymous_browser: TestClient, admin: User
) -> None:
    """One address cannot try many accounts; another address is not bothered."""
    for attempt in range(10):
        assert _post(anonymous_browser, f"a{attempt}@x.example", WRONG).status_code == 401
    assert _post(anonymous_browser, admin.email).status_code == 429
    elsewhere = TestClient(app, client=("198.51.100.1", 1), follow_redirects=False)
    assert _post(elsewhere, admin.email).status_code == 303


def test_success_forgets_the_failures_of_the_account(app: FastAPI, admin: User) -> None:
    """Who mistypes now and then is not shut out in the end."""
    for attempt in range(4):
        browser = TestClient(app, client=(f"192.0.2.{attempt}", 1), follow_redirects=False)
        for _ in range(5):
            assert _post(browser, admin.email, WRONG).status_code == 401
        assert _post(browser, admin.email).status_code == 303


ELSEWHERE = [
    "javascript:alert(1)",
    "//evil.example",
    "/\\evil.example",
    "\\\\evil.example",
    "https://evil.example/",
    "/\t/evil.example",
    "\n//evil.example",
    "data:text/html,x",
    "evil",
    "",
]


def test_signing_in_leads_nowhere_else(anonymous_browser: TestClient, admin: User) -> None:
    """A destination that is not a path of this site is replaced by the home page."""
    for elsewhere in ELSEWHERE:
        shown = anonymous_browser.get("/sign-in", params={"next": elsewhere})
        assert 'name="next" value="/"' in shown.text
        answer = _post(anonymous_browser, admin.email, next=elsewhere)
        assert (answer.status_code, answer.headers["location"]) == (303, "/")
        again = anonymous_browser.get("/sign-in", params={"next": elsewhere})
        assert (again.status_code, again.headers["location"]) == (303, "/")
        anonymous_browser.cookies.clear()


def test_a_page_asked_for_comes_back_after_signing_in(
    anonymous_browser: TestClient, admin: User
) -> None:
    """The way from a page over the sign-in form leads back to it, with its query."""
    asked = anonymous_browser.get("/admin/audit?entity=user")
    assert asked.headers["location"] == "/sign-in?next=/admin/audit%3Fentity%3Duser"
    form = anonymous_browser.get(asked.headers["location"])
    assert 'name="next" value="/admin/audit?entity=user"' in form.text
    answer = _post(anonymous_browser, admin.email, next="/admin/audit?entity=user")
    assert answer.headers["location"] == "/admin/audit?entity=user"


def test_nobody_signs_up(anonymous: TestClient) -> None:
    """There is no route that would make an account for a stranger."""
    for path in ("/sign-up", "/register", "/api/v1/sign-up", "/api/v1/register"):
        assert anonymous.post(path, json={}).status_code == 404
    body = {"email": "me@evil.example", "password": "correct horse battery"}
    assert anonymous.post("/api/v1/users", json=body).status_code == 401


def test_one_changes_ones_own_password(
    browser_of: Callable[[User], TestClient],
    anonymous_browser: TestClient,
    make_user: Callable[..., User],
) -> None:
    """It takes the old one, and signs the other browsers out."""
    user = make_user("viewer")
    here, there = browser_of(user), browser_of(user)
    form = {"old_password": WRONG, "new_password": "another horse battery"}
    assert here.post("/account/password", data=form).status_code == 422
    form["old_password"] = identity.PASSWORD
    assert here.post("/account/password", data=form).status_code == 303
    assert here.get("/account").status_code == 200
    assert there.get("/account").status_code == 303
    assert _post(anonymous_browser, user.email).status_code == 401
    assert _post(anonymous_browser, user.email, "another horse battery").status_code == 303
