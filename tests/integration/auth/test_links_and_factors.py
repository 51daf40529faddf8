"""People come by links, lose passwords and phones, hand work over and leave; reviews stay."""

import re
from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
from fastapi import FastAPI
from sqlalchemy.orm import Session
from starlette.testclient import TestClient

from app.auth import totp
from app.db import Database, now
from app.domain.grading import GUIDELINE_VERSION
from app.reviews.schemas import ReviewOut
from app.tables.identity import AccountLink, AuditEntry, LoginSession, Role, User
from app.tables.queues import ReviewQueueItem
from app.tables.reviews import Grade, Review
from tests.factories import identity
from tests.factories.world import make_world
from tests.integration.conftest import MakeUser

Browse = Callable[[User], TestClient]
PASSWORD = "four words easily kept"
LINK = re.compile(r"<pre[^>]*>http://testserver(/join\?token=[^<]+)</pre>")


def join(browser: TestClient, path: str, **fields: str) -> int:
    """Follow a link with its form; returns the status."""
    token = path.partition("token=")[2]
    return browser.post("/join", data={"token": token, "password": PASSWORD} | fields).status_code


def sign_in(browser: TestClient, email: str, password: str = PASSWORD) -> str:
    """Sign in; returns where that leads, or nothing."""
    answer = browser.post("/sign-in", data={"email": email, "password": password})
    return answer.headers.get("location", "")


def test_an_invitation_works_once(
    browser_of: Browse, admin: User, anonymous_browser: TestClient, database: Database
) -> None:
    """Whoever follows the link has the role it carries; the second time it is gone."""
    invited = {"email": "ada@harbour.example", "role": "reviewer", "site_id": ""}
    shown = browser_of(admin).post("/admin/invitations", data=invited).text
    found = LINK.search(shown)
    assert found is not None
    path = found[1]
    assert "ada@harbour.example" in anonymous_browser.get(path).text
    assert join(anonymous_browser, path, name="Ada", password="short") == 422
    assert join(anonymous_browser, path, name="Ada") == 303
    assert join(anonymous_browser, path) == 404
    assert anonymous_browser.get(path).status_code == 404
    assert sign_in(anonymous_browser, "ada@harbour.example") == "/"
    with database.reading() as session:
        ada = session.scalars(sa.select(User).where(User.name == "Ada")).one()
        assert [(m.role, m.site_id) for m in ada.memberships] == [(Role.REVIEWER, None)]


def test_an_expired_or_withdrawn_invitation_is_worthless(
    browser_of: Browse, admin: User, anonymous_browser: TestClient, database: Database
) -> None:
    """Time and the administrator each end a link; another site's administrator makes none."""
    browser = browser_of(admin)
    invited = {"email": "ada@harbour.example", "role": "viewer"}
    paths = []
    for _ in range(2):
        found = LINK.search(browser.post("/admin/invitations", data=invited).text)
        assert found is not None
        paths.append(found[1])
    with database.writing() as session:
        first, second = session.scalars(sa.select(AccountLink).order_by(AccountLink.id))
        first.expires_at = now() - timedelta(seconds=1)
        session.flush()
        second_id = second.id
    assert browser.post("/admin/invitations/withdraw", data={"link_id": second_id}).is_redirect
    assert [join(anonymous_browser, path) for path in paths] == [404, 404]


def test_a_forgotten_password_is_set_anew_by_a_link(
    browser_of: Browse, admin: User, make_user: MakeUser, anonymous_browser: TestClient
) -> None:
    """The link sets the password and signs the person's browsers out."""
    reviewer = make_user(Role.REVIEWER, email="eve@harbour.example")
    old = browser_of(reviewer)
    found = LINK.search(browser_of(admin).post(f"/admin/users/{reviewer.id}/reset-link").text)
    assert found is not None
    assert join(anonymous_browser, found[1]) == 303
    assert old.get("/account").headers["location"].startswith("/sign-in")
    assert sign_in(anonymous_browser, reviewer.email, identity.PASSWORD) == ""
    assert sign_in(anonymous_browser, reviewer.email) == "/"


def set_up_factor(browser: TestClient) -> tuple[str, list[str]]:
    """Turn the second factor on; returns its secret and the recovery codes."""
    secret = re.search(
        r'name="secret" value="([A-Z2-7]+)"', browser.get("/account/second-factor").text
    )
    assert secret is not None
    code = totp.code_of_step(secret[1], totp.step_of(now()))
    entered = {"secret": secret[1], "code": code, "password": identity.PASSWORD}
    wrong = browser.post("/account/second-factor", data=entered | {"password": "wrong"})
    assert wrong.status_code == 422
    shown = browser.post("/account/second-factor", data=entered)
    assert shown.status_code == 200
    return secret[1], re.findall(r"^(?:<pre>)?([0-9a-f]{16})$", shown.text, re.MULTILINE)


def test_a_second_factor_is_asked_for_and_takes_no_code_twice(
    browser_of: Browse, make_user: MakeUser, anonymous_browser: TestClient, database: Database
) -> None:
    """The password alone opens nothing; a recovery code works once, a replayed code never."""
    person = make_user(Role.REVIEWER, email="eve@harbour.example")
    secret, recovery = set_up_factor(browser_of(person))
    assert len(recovery) == 10
    browser = anonymous_browser
    assert sign_in(browser, person.email, identity.PASSWORD).startswith("/sign-in/code")
    assert browser.get("/account").status_code == 303
    with database.reading() as session:
        used = session.get_one(User, person.id).totp_last_step
    assert used is not None
    replayed = browser.post("/sign-in/code", data={"code": totp.code_of_step(secret, used)})
    assert replayed.status_code == 401
    later = browser.post("/sign-in/code", data={"code": totp.code_of_step(secret, used + 1)})
    assert later.headers["location"] == "/"
    assert browser.get("/account").status_code == 200
    for answer in (303, 401):
        browser.cookies.clear()
        sign_in(browser, person.email, identity.PASSWORD)
        sent = browser.post("/sign-in/code", data={"code": recovery[0]})
        assert sent.status_code == answer
    with database.reading() as session:
        stored = session.scalars(sa.select(LoginSession.awaits_code)).all()
    assert set(stored) == {True, False}


def test_guessing_codes_is_slowed_down(
    app: FastAPI, browser_of: Browse, make_user: MakeUser, anonymous_browser: TestClient
) -> None:
    """After ten wrong codes the answer is 429, for a right one too."""
    person = make_user(Role.REVIEWER, email="eve@harbour.example")
    _, recovery = set_up_factor(browser_of(person))
    sign_in(anonymous_browser, person.email, identity.PASSWORD)
    codes = ["000000"] * 10 + [recovery[0]]
    answers = [
        anonymous_browser.post("/sign-in/code", data={"code": code}).status_code for code in codes
    ]
    assert answers == [401] * 10 + [429]
    assert app


def test_a_demanded_second_factor_keeps_everything_shut(
    browser_of: Browse, admin: User, make_user: MakeUser, database: Database
) -> None:
    """Until it is set up the person may only see their account; then they may what they may."""
    with database.writing() as session:
        site_id = make_world(session, "Elbe", 211000001)["site_id"]
    person = make_user(Role.REVIEWER, site_id)
    browser = browser_of(person)
    assert browser.get("/sites").status_code == 200
    browser_of(admin).post(f"/admin/users/{person.id}/second-factor", data={"wanted": "demand"})
    assert browser.get("/sites").status_code == 403
    assert "demands a second factor" in browser.get("/account").text
    set_up_factor(browser)
    assert browser.get("/sites").status_code == 200
    off = browser.post("/account/second-factor/off", data={"password": identity.PASSWORD})
    assert off.status_code == 409


def test_browsers_are_listed_and_signed_out(browser_of: Browse, make_user: MakeUser) -> None:
    """One browser ends another, and then all at once."""
    person = make_user(Role.REVIEWER)
    one, other = browser_of(person), browser_of(person)
    ids = re.findall(r'name="session_id" value="(\d+)"', one.get("/account").text)
    assert len(ids) == 2
    assert one.post("/account/sessions/end", data={"session_id": ids[0]}).status_code == 303
    assert other.get("/account").status_code == 303
    assert one.post("/account/sessions/end", data={"session_id": 9999}).status_code == 404
    one.post("/account/sign-out-everywhere")
    assert one.get("/account").status_code == 303


def hold(session: Session, ids: dict[str, int], user_id: int) -> None:
    """Let a person hold the pose in the queue."""
    session.add(
        ReviewQueueItem(
            queue_id=ids["queue_id"],
            position=0,
            image_id=ids["image_id"],
            pose_id=ids["pose_id"],
            user_id=user_id,
            leased_until=now() + timedelta(hours=1),
        )
    )


def test_a_removed_persons_reviews_stay_without_their_name(
    client: TestClient, database: Database, anonymous_browser: TestClient
) -> None:
    """The review is by "removed reviewer N"; address and name are nowhere to be found."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
    body = {"email": "eve@harbour.example", "password": PASSWORD, "name": "Eve"}
    person = client.post("/api/v1/users", json=body).json()
    with database.writing() as session:
        session.execute(sa.delete(Review))
        session.add(
            Review(
                pose_id=ids["pose_id"],
                user_id=person["id"],
                grade=Grade.GOOD,
                reasons=[],
                guideline_version=GUIDELINE_VERSION,
            )
        )
        hold(session, ids, person["id"])
    assert client.delete(f"/api/v1/users/{person['id']}").status_code == 204

    with database.reading() as session:
        review = ReviewOut.of(session.scalars(sa.select(Review)).one())
    assert (review.user, review.grade) == (f"removed reviewer {person['id']}", Grade.GOOD)
    assert "Eve" not in client.get("/api/v1/users").text
    assert client.get(f"/api/v1/users/{person['id']}").status_code == 404
    assert sign_in(anonymous_browser, "eve@harbour.example") == ""
    with database.reading() as session:
        assert "eve@" not in str(session.scalars(sa.select(AuditEntry.details)).all())
        assert session.scalars(sa.select(ReviewQueueItem.user_id)).all() == [None]


def test_open_work_is_handed_over(
    browser_of: Browse, admin: User, make_user: MakeUser, database: Database
) -> None:
    """What somebody holds in queues is another's, with a fresh lease and a line in the log."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
    giver, taker = (make_user(Role.REVIEWER, ids["site_id"]) for _ in range(2))
    with database.writing() as session:
        hold(session, ids, giver.id)
    browser_of(admin).post(f"/admin/users/{giver.id}/hand-over", data={"taker_id": taker.id})
    with database.reading() as session:
        item = session.scalars(sa.select(ReviewQueueItem)).one()
        assert (item.user_id, item.leased_until is not None) == (taker.id, True)
        entry = session.scalars(sa.select(AuditEntry).where(AuditEntry.action == "hand over")).one()
    assert entry.details == {"taker_id": taker.id, "items": 1}
