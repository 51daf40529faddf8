"""`quaymark user` and `quaymark token`.

There is no default password. At a terminal a new one is asked for twice; a script gives it on
standard input, or has one made and printed this once.
"""

import json
import secrets
import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from app.errors import Invalid

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from app.tables.identity import User

Email = Annotated[str, typer.Argument(help="The person's e-mail address")]
PasswordOnStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from standard input")
]
Choice = TypeVar("Choice", bound=StrEnum)


def register(cli: typer.Typer) -> None:
    """Add the commands."""
    people = typer.Typer(name="user", help="People who can sign in.", no_args_is_help=True)
    people.command()(add)
    people.command("list")(list_people)
    people.command("reset-password")(reset_password)
    people.command()(remove)
    cli.add_typer(people)
    tokens = typer.Typer(name="token", help="Keys for scripts.", no_args_is_help=True)
    tokens.command("create")(create_token)
    cli.add_typer(tokens)


def add(
    email: Email,
    role: Annotated[str, typer.Option(help="viewer, reviewer, operator or admin")],
    site: Annotated[str | None, typer.Option(help="Name or id of a site; else all")] = None,
    name: Annotated[str, typer.Option(help="How pages call them")] = "",
    *,
    password_stdin: PasswordOnStdin = False,
) -> None:
    """Add a person."""
    from app.auth import users
    from app.installation import open_installation
    from app.tables.identity import Role

    chosen = _choice(Role, role, "--role")
    with open_installation() as here:
        with here.database.reading() as session:
            site_id = None if site is None else _site_id(session, site)
        password, made = _password(password_stdin=password_stdin)
        with here.database.writing() as session:
            user = users.create_user(
                session, email, password, [users.MembershipSpec(chosen, site_id)], name=name
            )
    typer.echo(f"added {user.email}, {chosen} of " + (f"site {site}" if site else "all sites"))
    _print_once(password, made=made)


def list_people(
    *, as_json: Annotated[bool, typer.Option("--json", help="Print JSON")] = False
) -> None:
    """List the people who can sign in, and their roles."""
    from app.auth import users
    from app.auth.schemas import UserOut
    from app.installation import open_installation

    with open_installation() as here, here.database.reading() as session:
        people = users.all_users(session)
    if as_json:
        found = [UserOut.of(user).model_dump(mode="json") for user in people]
        typer.echo(json.dumps(found, indent=1))
        return
    for user in people:
        inactive = "" if user.is_active else "  (inactive)"
        typer.echo(f"{user.email:<32} {_roles(user)}{inactive}")


def _roles(user: "User") -> str:
    return ", ".join(
        f"{membership.role} of "
        + ("all sites" if membership.site_id is None else f"site {membership.site_id}")
        for membership in user.memberships
    )


def reset_password(email: Email, *, password_stdin: PasswordOnStdin = False) -> None:
    """Give a person a new password; their browsers are signed out."""
    from app.auth import users
    from app.installation import open_installation

    with open_installation() as here:
        with here.database.reading() as session:
            users.user_named(session, email)  # before a password is asked for in vain
        password, made = _password(password_stdin=password_stdin)
        with here.database.writing() as session:
            user = users.user_named(session, email)
            users.change_user(session, user, users.UserChange(password=password))
    typer.echo(f"{user.email} has a new password")
    _print_once(password, made=made)


def remove(email: Email) -> None:
    """Remove a person; what they made stays."""
    from app.auth import users
    from app.installation import open_installation

    with open_installation() as here, here.database.writing() as session:
        users.remove_user(session, users.user_named(session, email))
    typer.echo(f"removed {email}")


def create_token(
    email: Email,
    scope: Annotated[
        list[str],
        typer.Option(help="read, review, register, ingest, export or admin; repeat for more"),
    ],
    more: Annotated[
        list[str] | None, typer.Argument(metavar="[SCOPE]...", help="Further scopes")
    ] = None,
    expires: Annotated[int, typer.Option(help="Days until it expires", min=1)] = 90,
    name: Annotated[str, typer.Option(help="What it is for")] = "command line",
) -> None:
    """Make a token that acts for a person, and print it this once."""
    from app.auth import audit, service, users
    from app.auth.access import Scope
    from app.installation import open_installation

    scopes = [_choice(Scope, text, "--scope") for text in (*scope, *(more or ()))]
    with open_installation() as here, here.database.writing() as session:
        user = users.user_named(session, email)
        token, text = service.issue_token(session, user.id, name=name, scopes=scopes, days=expires)
        audit.record(session, None, "create", "token", token.id, user=user.email, name=name)
    typer.echo(text)


def _choice(choices: type[Choice], text: str, option: str) -> Choice:
    try:
        return choices(text)
    except ValueError as error:
        known = ", ".join(choices)
        raise typer.BadParameter(f"{text!r} is none of {known}", param_hint=option) from error


def _site_id(session: "Session", text: str) -> int:
    from app.auth import service

    site_id = service.site_id_named(session, text)
    if site_id is None:
        raise Invalid.field("site", f"there is no site {text!r}")
    return site_id


def _password(*, password_stdin: bool) -> tuple[str, bool]:
    """Return a new password, and whether it was made here and is to be shown."""
    if password_stdin:
        return sys.stdin.readline().rstrip("\r\n"), False
    if sys.stdin.isatty():
        return typer.prompt("Password", hide_input=True, confirmation_prompt=True), False
    return secrets.token_urlsafe(12), True


def _print_once(password: str, *, made: bool) -> None:
    if made:
        typer.echo(f"password (shown this once): {password}")
