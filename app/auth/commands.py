"""`quaymark user` and `quaymark token`."""

import secrets
import sys
from typing import Annotated

import typer

from app.auth import audit, repository, service, users
from app.auth.access import Scope
from app.config import get_settings
from app.db import Database
from app.errors import Invalid
from app.tables.identity import Role

Email = Annotated[str, typer.Argument(help="The person's e-mail address")]
PasswordOnStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from standard input")
]


def register(cli: typer.Typer) -> None:
    """Add the commands."""
    people = typer.Typer(name="user", help="People who can sign in.", no_args_is_help=True)
    people.command()(add)
    people.command("reset-password")(reset_password)
    people.command()(remove)
    cli.add_typer(people)
    tokens = typer.Typer(name="token", help="Keys for scripts.", no_args_is_help=True)
    tokens.command("create")(create_token)
    cli.add_typer(tokens)


def add(
    email: Email,
    role: Annotated[Role, typer.Option(help="What they are to the site, or to all sites")],
    site: Annotated[str | None, typer.Option(help="Name or id of a site; else all")] = None,
    name: Annotated[str, typer.Option(help="How pages call them")] = "",
    *,
    password_stdin: PasswordOnStdin = False,
) -> None:
    """Add a person; without --password-stdin a password is made and printed once."""
    password, made = _password(password_stdin=password_stdin)
    with Database(get_settings().database_url).writing() as session:
        site_id = None if site is None else repository.site_id_named(session, site)
        if site is not None and site_id is None:
            raise Invalid.field("site", f"there is no site {site!r}")
        user = users.create_user(
            session, email, password, [users.MembershipSpec(role, site_id)], name=name
        )
    typer.echo(f"added {user.email}, {role}" + (f" of {site}" if site else " of all sites"))
    _print_once(password, made=made)


def reset_password(email: Email, *, password_stdin: PasswordOnStdin = False) -> None:
    """Give a person a new password; their browsers are signed out."""
    password, made = _password(password_stdin=password_stdin)
    with Database(get_settings().database_url).writing() as session:
        user = users.user_named(session, email)
        users.change_user(session, user, users.UserChange(password=password))
    typer.echo(f"{user.email} has a new password")
    _print_once(password, made=made)


def remove(email: Email) -> None:
    """Remove a person; what they made stays."""
    with Database(get_settings().database_url).writing() as session:
        users.remove_user(session, users.user_named(session, email))
    typer.echo(f"removed {email}")


def create_token(
    email: Email,
    scope: Annotated[list[Scope], typer.Option(help="What it may do; once for each scope")],
    expires: Annotated[int, typer.Option(help="Days until it expires", min=1)] = 90,
    name: Annotated[str, typer.Option(help="What it is for")] = "command line",
) -> None:
    """Make a token that acts for a person, and print it this once."""
    with Database(get_settings().database_url).writing() as session:
        user = users.user_named(session, email)
        token, text = service.issue_token(session, user.id, name=name, scopes=scope, days=expires)
        audit.record(session, None, "create", "token", token.id, user=user.email, name=name)
    typer.echo(text)


def _password(*, password_stdin: bool) -> tuple[str, bool]:
    if password_stdin:
        return sys.stdin.readline().rstrip("\r\n"), False
    return secrets.token_urlsafe(12), True


def _print_once(password: str, *, made: bool) -> None:
    if made:
        typer.echo(f"password (shown this once): {password}")
