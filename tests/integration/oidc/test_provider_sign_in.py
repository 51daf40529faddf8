"""Signing in at an identity provider, an honest one and one that lies."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import httpx2
import pytest
import sqlalchemy as sa
from fastapi import FastAPI
from pydantic import ValidationError
from starlette.testclient import TestClient

from app.auth import links
from app.auth.access import Access
from app.auth.authentication import SESSION_COOKIE
from app.auth.totp import new_secret
from app.config import Settings
from app.db import Database
from app.main import furnish
from app.oidc import provider as oidc
from app.tables.identity import AuditEntry, Membership, ProviderIdentity, Role, User
from tests.factories.sites import make_site
from tests.identity_provider import IdentityProvider
from tests.integration.conftest import MakeUser

LOCAL = {"oidc_allowed_networks": ["127.0.0.0/8"], "public_url": "http://testserver"}
Browsers = Callable[..., TestClient]


@pytest.fixture(scope="module")
def shared_provider() -> Iterator[IdentityProvider]:
    """Serve one provider for all tests: making its key takes longer than most of them."""
    with IdentityProvider() as serving:
        yield serving


@pytest.fixture
def provider(shared_provider: IdentityProvider) -> Iterator[IdentityProvider]:
    """Give a provider that is honest yet."""
    person = dict(shared_provider.person)
    yield shared_provider
    shared_provider.person = person
    shared_provider.claims.clear()
    shared_provider.lies.clear()


@pytest.fixture
def browser(routes: FastAPI, settings: Settings, provider: IdentityProvider) -> Iterator[Browsers]:
    """Give the maker of browsers of an installation with this provider and further settings."""
    opened: list[TestClient] = []

    def make(**chosen: Any) -> TestClient:
        furnish(routes, Settings(**settings.model_dump() | LOCAL | provider.environment() | chosen))
        client = TestClient(
            routes,
            headers={"Accept": "text/html", "Sec-Fetch-Site": "none"},
            follow_redirects=False,
        )
        opened.append(client.__enter__())
        return client

    yield make
    for client in opened:
        client.__exit__()


def go(browser: TestClient, wanted: str = "/runs") -> str:
    """Begin at the sign-in page, be let in by the provider; returns the way back, not yet gone."""
    begun = browser.get("/sign-in/provider", params={"next": wanted})
    assert begun.status_code == 303, begun.text
    return httpx.get(begun.headers["location"]).headers["location"]


def sign_in(browser: TestClient, wanted: str = "/runs") -> httpx2.Response:
    """Sign in at the provider and come back."""
    return browser.get(go(browser, wanted))


def test_an_existing_person_is_known_by_a_verified_address(
    browser: Browsers, make_user: MakeUser, database: Database
) -> None:
    """The first sign-in binds the identity, later ones need no address; each is in the log."""
    ada = make_user(Role.REVIEWER, email="Ada@harbour.example")
    client = browser()
    assert 'href="/sign-in/provider?next=' in client.get("/sign-in").text
    answer = sign_in(client)
    assert (answer.status_code, answer.headers["location"]) == (303, "/runs"), answer.text
    assert client.get("/account").status_code == 200
    left = client.post("/sign-out", headers={"Sec-Fetch-Site": "same-origin"})
    shown = client.get(left.headers["location"]).text
    assert 'href="/sign-in/provider/sign-out"' in shown
    assert "/end?client_id=" in client.get("/sign-in/provider/sign-out").headers["location"]
    with database.reading() as session:
        identity = session.scalars(sa.select(ProviderIdentity)).one()
        actions = session.scalars(sa.select(AuditEntry.action).order_by(AuditEntry.id)).all()
    assert (identity.user_id, identity.subject) == (ada.id, "person-1")
    assert actions == ["link", "sign-in", "sign-out"]


def test_who_was_known_once_stays_known_whatever_the_address(
    browser: Browsers, provider: IdentityProvider, make_user: MakeUser, database: Database
) -> None:
    """The subject decides; another subject with the address of somebody bound is refused."""
    make_user(Role.REVIEWER, email="ada@harbour.example")
    client = browser()
    assert sign_in(client).is_redirect
    provider.person |= {"email": "ada.king@harbour.example", "email_verified": False}
    assert sign_in(client).is_redirect
    provider.person |= {"sub": "2", "email": "ada@harbour.example", "email_verified": True}
    answer = sign_in(client)
    assert answer.status_code == 403
    assert "belongs to another identity" in answer.text
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(ProviderIdentity)) == 1


LIES: list[dict[str, Any]] = [
    {"claims": {"nonce": "another"}},
    {"claims": {"nonce": None}},
    {"claims": {"aud": "another client"}},
    {"claims": {"aud": ["quaymark", "another"]}},
    {"claims": {"iss": "https://another.example"}},
    {"claims": {"exp": 1_700_000_000}},
    {"claims": {"exp": None}},
    {"claims": {"iat": 4_000_000_000}},
    {"claims": {"sub": None}},
    {"claims": {"sub": 7}},
    {"claims": {"at_hash": "AAAA"}},
    {"lies": {"no signature"}},
    {"lies": {"shared secret"}},
    {"lies": {"other key"}},
    {"lies": {"denied"}},
    {"person": {"email_verified": False}},
    {"person": {"email_verified": None}},
    {"person": {"email": "nobody@harbour.example"}},
    {"person": {"email": ["ada@harbour.example"]}},
]


def test_no_lie_lets_anybody_in(
    browser: Browsers, provider: IdentityProvider, make_user: MakeUser, database: Database
) -> None:
    """A token for others, of others, too old, unsigned, or an address unverified: 403, nothing."""
    make_user(Role.ADMIN, email="ada@harbour.example")
    client = browser(sign_in_attempts=1000)
    honest = dict(provider.person)
    for lie in LIES:
        provider.claims, provider.lies = dict(lie.get("claims", {})), set(lie.get("lies", ()))
        provider.person = honest | lie.get("person", {})
        answer = sign_in(client)
        assert (answer.status_code, SESSION_COOKIE in answer.cookies) == (403, False), lie
        assert 'role="alert"' in answer.text
        assert "Traceback" not in answer.text
    with database.reading() as session:
        assert session.scalars(sa.select(ProviderIdentity)).all() == []
        assert session.scalars(sa.select(AuditEntry)).all() == []


def test_a_way_back_works_once_and_in_the_browser_that_went(
    browser: Browsers, make_user: MakeUser
) -> None:
    """A code used again, a forged state, another's way back and another issuer's are refused."""
    make_user(Role.REVIEWER, email="ada@harbour.example")
    client = browser()
    back = go(client)
    cookie = client.cookies["quaymark_provider"]
    other = TestClient(client.app, follow_redirects=False)
    assert other.get(back).status_code == 403
    assert client.get(back).status_code == 303
    assert client.get(back).status_code == 403
    client.cookies.set("quaymark_provider", cookie, path="/sign-in/provider")
    assert client.get(back).status_code == 403
    forged = go(client).replace("state=", "state=x")
    assert client.get(forged).status_code == 403
    elsewhere = go(client).replace("iss=http", "iss=https")
    assert client.get(elsewhere).status_code == 403
    for wanted in ("//evil.example", "javascript:alert(1)", "https://evil.example"):
        client.cookies.clear()
        assert sign_in(client, wanted).headers["location"] == "/"


def test_guessing_at_the_way_back_is_slowed_down(browser: Browsers) -> None:
    """After ten refusals from an address the answer is 429; passwords are still taken."""
    client = browser()
    answers = [client.get(oidc.CALLBACK, params={"code": "x", "state": "y"}) for _ in range(11)]
    assert [answer.status_code for answer in answers] == [403] * 10 + [429]
    assert int(answers[-1].headers["retry-after"]) > 0
    wrong = client.post("/sign-in", data={"email": "a@b.example", "password": "wrong"})
    assert wrong.status_code == 401


def test_changed_keys_are_fetched_and_clocks_may_differ(
    browser: Browsers,
    provider: IdentityProvider,
    make_user: MakeUser,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A token of a new key is good as soon as the key is published, and one 30 s too early too."""
    make_user(Role.REVIEWER, email="ada@harbour.example")
    client = browser()
    assert sign_in(client).is_redirect
    monkeypatch.setattr(oidc, "REFETCH_AFTER_S", 0.0)
    provider.change_keys()
    provider.claims = {"iat": int(time.time()) + 30, "exp": int(time.time()) - 30}
    assert sign_in(client).is_redirect


def test_strangers_come_by_invitation_or_by_their_groups(
    browser: Browsers, provider: IdentityProvider, make_user: MakeUser, database: Database
) -> None:
    """An invitation is used up; groups give roles on sites, the strongest; others stay outside."""
    with database.writing() as session:
        site_id = make_site(session, "Elbe").id
    admin = Access(make_user(Role.ADMIN).id, "", "", {None: Role.ADMIN})
    with database.writing() as session:
        links.invite(
            session, admin, email=provider.person["email"], role=Role.REVIEWER, site_id=site_id
        )
    guest = browser()
    assert sign_in(guest).is_redirect
    assert roles_of(database, "ada@harbour.example") == [(Role.REVIEWER, site_id)]

    provider.person |= {"sub": "2", "email": "eve@harbour.example", "name": "Eve"}
    provider.claims = {"realm": {"groups": ["pilots", "staff", "other"]}}
    chosen: dict[str, Any] = {
        "oidc_create_people": True,
        "oidc_roles_claim": "realm.groups",
        "oidc_roles": {"pilots": "operator@Elbe", "staff": "viewer@Elbe", "boss": "admin"},
        "oidc_email_domains": ["harbour.example"],
    }
    newcomer = browser(**chosen)
    assert sign_in(newcomer).is_redirect
    assert roles_of(database, "eve@harbour.example") == [(Role.OPERATOR, site_id)]
    provider.claims = {"realm": {"groups": ["staff"]}}
    assert sign_in(newcomer).is_redirect
    assert roles_of(database, "eve@harbour.example") == [(Role.VIEWER, site_id)]
    provider.claims = {}
    assert sign_in(newcomer).is_redirect
    assert roles_of(database, "eve@harbour.example") == [(Role.VIEWER, site_id)]
    for person in (
        {"sub": "3", "email": "mallory@harbour.example"},
        {"sub": "4", "email": "mallory@evil.example"},
    ):
        provider.person |= person
        assert sign_in(newcomer).status_code == 403


def roles_of(database: Database, email: str) -> list[tuple[Role, int | None]]:
    """Return somebody's roles."""
    with database.reading() as session:
        statement = sa.select(Membership.role, Membership.site_id).join(User)
        return [
            (role, site) for role, site in session.execute(statement.where(User.email == email))
        ]


def test_the_last_administrator_stays_one_whatever_groups_say(
    browser: Browsers, provider: IdentityProvider, make_user: MakeUser, database: Database
) -> None:
    """A mapping that would leave nobody to administer changes nothing, and still lets in."""
    make_user(Role.ADMIN, email="ada@harbour.example")
    provider.claims = {"groups": ["staff"]}
    client = browser(oidc_roles={"staff": "viewer"})
    assert sign_in(client).is_redirect
    assert roles_of(database, "ada@harbour.example") == [(Role.ADMIN, None)]
    assert client.get("/admin/users").status_code == 200


@pytest.mark.parametrize(
    ("whose", "methods", "leads_to"),
    [
        ("ours", None, "/sign-in/code?next=%2Fruns"),
        ("provider", ["pwd", "otp"], "/runs"),
        ("provider", ["pwd"], "/sign-in/code?next=%2Fruns"),
    ],
)
def test_whose_second_factor_counts_is_a_setting(
    browser: Browsers,
    provider: IdentityProvider,
    make_user: MakeUser,
    database: Database,
    whose: str,
    methods: list[str] | None,
    leads_to: str,
) -> None:
    """Ours is asked for, or the provider's counts unless it says itself that there was none."""
    ada = make_user(Role.REVIEWER, email="ada@harbour.example")
    with database.writing() as session:
        session.get_one(User, ada.id).totp_secret = new_secret()
    provider.claims = {"amr": methods}
    answer = sign_in(browser(oidc_second_factor=whose))
    assert answer.headers["location"] == leads_to


def test_a_provider_that_is_away_or_inside_is_told(
    browser: Browsers, provider: IdentityProvider
) -> None:
    """Discovery of another issuer, an address inside and a closed port: a page with 503."""
    provider.lies = {"issuer of discovery"}
    assert browser().get("/sign-in/provider").status_code == 503
    provider.lies = set()
    for chosen in (
        {"oidc_allowed_networks": ["192.168.7.0/24"]},
        {"oidc_issuer": "http://127.0.0.1:9"},
    ):
        answer = browser(**chosen).get("/sign-in/provider")
        assert (answer.status_code, "does not answer" in answer.text) == (503, True)
        assert answer.headers["retry-after"]


def test_settings_that_are_half_a_provider_are_refused(settings: Settings) -> None:
    """What is missing is named, and no secret goes over plain http."""
    whole: dict[str, Any] = settings.model_dump() | {
        "oidc_issuer": "https://id.example",
        "oidc_client_id": "quaymark",
        "public_url": "https://quay.example",
    }
    assert Settings(**whole).has_provider
    for wrong, named in (
        ({"oidc_client_id": ""}, "OIDC_CLIENT_ID"),
        ({"public_url": ""}, "PUBLIC_URL"),
        ({"oidc_issuer": "http://id.example"}, "https"),
        ({"oidc_create_people": True}, "OIDC_ROLES"),
        ({"oidc_roles": {"pilots": "captain"}}, "captain"),
    ):
        with pytest.raises(ValidationError, match=named):
            Settings(**whole | wrong)
