"""`quaymark user` and `quaymark token`."""

import json

import pytest

from app.auth.passwords import password_fits
from app.auth.service import authenticate
from app.auth.users import user_named
from app.db import Database, now
from app.tables.identity import LoginSession, Role, User
from tests.factories.identity import make_login_session, make_user
from tests.factories.sites import make_site
from tests.integration.commands.conftest import Shell

EMAIL = "ada@harbour.example"
PASSWORD = "four words are easily kept"


def stored(database: Database, email: str = EMAIL) -> User:
    """Return a person as stored."""
    with database.reading() as session:
        return user_named(session, email)


def test_a_password_from_standard_input_signs_in(quaymark: Shell, database: Database) -> None:
    """--password-stdin takes the first line as it is, and prints it nowhere."""
    outcome = quaymark(
        "user", "add", EMAIL, "--role", "admin", "--password-stdin", stdin=f"{PASSWORD}\n"
    )

    assert outcome.code == 0, outcome.error
    assert password_fits(PASSWORD, stored(database).password_hash)
    assert PASSWORD not in outcome.out + outcome.error


def test_without_a_terminal_a_password_is_made_and_printed_once(
    quaymark: Shell, database: Database
) -> None:
    """A script that gives no password gets a fresh one on standard output, and it works."""
    outcome = quaymark("user", "add", EMAIL, "--role", "viewer")

    assert outcome.code == 0, outcome.error
    password = outcome.out.rpartition(": ")[2].strip()
    assert password_fits(password, stored(database).password_hash)


def test_a_terminal_is_asked_for_the_password_twice(quaymark: Shell, database: Database) -> None:
    """At a terminal the password is typed twice, unseen, and never printed."""
    outcome = quaymark(
        "user", "add", EMAIL, "--role", "viewer", stdin=f"{PASSWORD}\n{PASSWORD}\n", terminal=True
    )

    assert outcome.code == 0, outcome.error
    assert password_fits(PASSWORD, stored(database).password_hash)
    assert PASSWORD not in outcome.out + outcome.error


@pytest.mark.parametrize("by_name", [True, False])
def test_a_role_on_one_site_is_given_by_name_or_id(
    quaymark: Shell, database: Database, *, by_name: bool
) -> None:
    """--site takes what people know: the site's name, or its id."""
    with database.writing() as session:
        site = make_site(session, "Norderelbe")
    outcome = quaymark(
        "user", "add", EMAIL, "--role", "reviewer", "--site", site.name if by_name else site.id
    )

    assert outcome.code == 0, outcome.error
    roles = [(each.role, each.site_id) for each in stored(database).memberships]
    assert roles == [(Role.REVIEWER, site.id)]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("user", "add", EMAIL, "--role", "captain"), 2, "viewer, reviewer, operator, admin"),
        (("user", "add", EMAIL, "--role", "admin", "--site", "nowhere"), 1, "no site 'nowhere'"),
        (("user", "add", "ada", "--role", "admin"), 1, "no e-mail address"),
        (("user", "reset-password", EMAIL), 1, "no user"),
        (("token", "create", EMAIL, "--scope", "everything"), 2, "read, review, register"),
        (("token", "create", EMAIL, "--scope", "read", "--expires", "0"), 2, "expires"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_is_stored(
    quaymark: Shell, arguments: tuple[str, ...], code: int, words: str
) -> None:
    """Bad arguments exit with 2, what the data refuses with 1; both say what to mend."""
    outcome = quaymark(*arguments)

    assert outcome.code == code
    assert words in " ".join(outcome.error.replace("│", " ").split())
    assert not outcome.out
    assert json.loads(quaymark("user", "list", "--json").out) == []


def test_people_are_listed_with_their_roles(quaymark: Shell, database: Database) -> None:
    """`user list` tells people and roles, as text and as JSON, and no hash of a password."""
    with database.writing() as session:
        make_user(session, Role.OPERATOR, email=EMAIL)

    assert quaymark("user", "list").out.split() == [EMAIL, "operator", "of", "all", "sites"]
    listed = json.loads(quaymark("user", "list", "--json").out)
    assert [(user["email"], user["memberships"]) for user in listed] == [
        (EMAIL, [{"role": "operator", "site_id": None}])
    ]
    assert "password" not in str(listed)


def test_a_new_password_signs_browsers_out(quaymark: Shell, database: Database) -> None:
    """`user reset-password` replaces the password and ends every session."""
    with database.writing() as session:
        make_login_session(session, make_user(session, Role.ADMIN, email=EMAIL))
    outcome = quaymark("user", "reset-password", EMAIL, "--password-stdin", stdin=PASSWORD)

    assert outcome.code == 0, outcome.error
    assert password_fits(PASSWORD, stored(database).password_hash)
    with database.reading() as session:
        assert session.query(LoginSession).count() == 0


def test_the_last_administrator_stays(quaymark: Shell, database: Database) -> None:
    """`user remove` removes people, but never the only one who could make others."""
    with database.writing() as session:
        make_user(session, Role.ADMIN, email=EMAIL)
        make_user(session, Role.VIEWER, email="bob@harbour.example")

    assert quaymark("user", "remove", "bob@harbour.example").code == 0
    outcome = quaymark("user", "remove", EMAIL)
    assert (outcome.code, outcome.error.count("\n")) == (1, 1)
    assert "last administrator" in outcome.error
    assert [user["email"] for user in json.loads(quaymark("user", "list", "--json").out)] == [EMAIL]


@pytest.mark.parametrize(
    "scopes", [("--scope", "read", "--scope", "export"), ("--scope", "read", "export")]
)
def test_a_token_is_all_that_is_printed(
    quaymark: Shell, database: Database, scopes: tuple[str, ...]
) -> None:
    """Standard output is the token alone, fit for a shell variable; it has just these scopes."""
    with database.writing() as session:
        make_user(session, Role.ADMIN, email=EMAIL)
    outcome = quaymark("token", "create", EMAIL, *scopes, "--expires", "7")

    assert outcome.code == 0, outcome.error
    with database.reading() as session:
        caller = authenticate(session, bearer=outcome.out.strip(), cookie=None, moment=now())
    assert caller is not None
    assert caller.access.scopes() == {"read", "export"}
