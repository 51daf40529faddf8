"""A whole application on each of the two databases, and people to use it as.

`database` runs a test twice: on a SQLite file and on a real Postgres. The schema is migrated once
for each kind; a test gets a copy of that and so begins with nothing.
"""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import pytest
from fastapi import FastAPI
from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher
from starlette.testclient import TestClient

from app.auth import passwords
from app.auth.access import Scope
from app.auth.authentication import SESSION_COOKIE
from app.config import Settings
from app.db import Database
from app.main import build_routes, furnish
from app.schema import upgrade
from app.tables.identity import Role, User
from tests.factories import identity
from tests.postgres import PostgresCluster
from tests.reused_database import ReusedDatabase

TEMPLATE = "quaymark_template"
CHEAP = PasswordHash((Argon2Hasher(time_cost=1, memory_cost=8, parallelism=1),))


@pytest.fixture(autouse=True)
def _cheap_passwords(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hash passwords with argon2 all the same, but not slowly: there is nothing to protect."""
    monkeypatch.setattr(passwords, "_hasher", CHEAP)


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Migrate a SQLite file, to be copied for each test."""
    path = tmp_path_factory.mktemp("schema") / "template.db"
    _migrate(f"sqlite:///{path}")
    return path


@pytest.fixture(scope="session")
def postgres_cluster() -> Iterator[PostgresCluster]:
    """Start a Postgres with a migrated template database."""
    with PostgresCluster() as cluster:
        _migrate(cluster.create(TEMPLATE))
        yield cluster


@pytest.fixture(scope="session")
def reused_database(postgres_cluster: PostgresCluster) -> Iterator[ReusedDatabase]:
    """Give the Postgres database that is emptied after each test."""
    reused = ReusedDatabase(postgres_cluster, "reused", TEMPLATE)
    yield reused
    reused.close()


def _migrate(url: str) -> None:
    database = Database(url)
    upgrade(database)
    database.dispose()


@pytest.fixture(params=["sqlite", "postgres"])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Give the address of a fresh, migrated database of each kind."""
    if request.param == "sqlite":
        template: Path = request.getfixturevalue("sqlite_template")
        path = tmp_path / "quaymark.db"
        shutil.copy(template, path)
        yield f"sqlite:///{path}"
        return
    reused: ReusedDatabase = request.getfixturevalue("reused_database")
    yield reused.lend()
    reused.take_back()


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    """Give a fresh database of each kind."""
    opened = Database(database_url)
    yield opened
    opened.dispose()


@pytest.fixture
def settings(database_url: str, tmp_path: Path) -> Settings:
    """Give the settings of an installation in the test's own folder."""
    return Settings(
        data_dir=tmp_path,
        database_url=database_url,
        storage_url=str(tmp_path / "files"),
    )


@pytest.fixture(scope="session")
def routes() -> FastAPI:
    """Build the routes once: that takes longer than most tests."""
    return build_routes()


@pytest.fixture
def app(routes: FastAPI, settings: Settings) -> Iterator[FastAPI]:
    """Give the running application."""
    furnish(routes, settings)
    with TestClient(routes):
        yield routes


class MakeUser(Protocol):
    """Stores a person with a role on one site, or on all."""

    def __call__(
        self,
        role: Role | str | None = Role.ADMIN,
        site_id: int | None = None,
        *,
        email: str | None = None,
        is_active: bool = True,
    ) -> User:
        """Return the stored person, whose password is `identity.PASSWORD`."""


@pytest.fixture
def make_user(database: Database) -> MakeUser:
    """Give the maker of people."""

    def make(
        role: Role | str | None = Role.ADMIN,
        site_id: int | None = None,
        *,
        email: str | None = None,
        is_active: bool = True,
    ) -> User:
        with database.writing() as session:
            return identity.make_user(session, role, site_id, email=email, is_active=is_active)

    return make


@pytest.fixture
def client_of(app: FastAPI, database: Database) -> Callable[..., TestClient]:
    """Give the maker of scripts: `client_of(user, Scope.READ, ...)`, by default with all scopes."""

    def make(user: User, *scopes: Scope) -> TestClient:
        with database.writing() as session:
            token = identity.make_token(session, user, scopes or tuple(Scope))
        return TestClient(app, headers={"Authorization": f"Bearer {token}"})

    return make


@pytest.fixture
def browser_of(app: FastAPI, database: Database) -> Callable[[User], TestClient]:
    """Give the maker of browsers: signed in by cookie, asking for HTML, not following redirects."""

    def make(user: User) -> TestClient:
        with database.writing() as session:
            cookie = identity.make_login_session(session, user)
        browser = _browser(app)
        browser.cookies.set(SESSION_COOKIE, cookie)
        return browser

    return make


@pytest.fixture
def anonymous(app: FastAPI) -> TestClient:
    """Give a script that sends no credentials."""
    return TestClient(app, follow_redirects=False)


@pytest.fixture
def anonymous_browser(app: FastAPI) -> TestClient:
    """Give a browser that is not signed in."""
    return _browser(app)


def _browser(app: FastAPI) -> TestClient:
    return TestClient(
        app,
        headers={"Accept": "text/html", "Sec-Fetch-Site": "same-origin"},
        follow_redirects=False,
    )


@pytest.fixture
def admin(make_user: MakeUser) -> User:
    """Give an administrator of all sites."""
    return make_user(Role.ADMIN, email="admin@harbour.example")


@pytest.fixture
def client(client_of: Callable[..., TestClient], admin: User) -> TestClient:
    """Give a script of an administrator, with a token of all scopes."""
    return client_of(admin)
