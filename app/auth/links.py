"""Links that an administrator hands out: to join, or to set a new password. Each works once.

No e-mail is needed: the administrator copies the link and sends it however they like. Its token
stands in the query string, which no log of ours keeps, and only its SHA-256 is stored.
"""

from dataclasses import dataclass
from datetime import timedelta

from sqlalchemy.orm import Session

from app.auth import audit, link_repository, passwords, repository, users
from app.auth.access import Access, Scope
from app.auth.letters import fresh_reset, path_of
from app.auth.tokens import new_token, token_sha256
from app.auth.users import MembershipSpec, normalised_email
from app.db import Database, now
from app.errors import Conflict, Invalid, NotFound
from app.tables.identity import AccountLink, LinkKind, Role, User

INVITATION_LASTS = timedelta(days=7)
NO_LINK = "this link was used already, has expired or never was; ask for a new one"


@dataclass(frozen=True, slots=True)
class HandedOut:
    """A fresh link: its path below the installation's address, shown this once."""

    link: AccountLink
    path: str


def invite(
    session: Session, access: Access, *, email: str, role: Role, site_id: int | None
) -> HandedOut:
    """Make an invitation for an address with a role on a site, or on all sites for None.

    Raises Invalid for a bad address or site, Conflict for an address in use.
    """
    access.require(Scope.ADMIN, None)
    try:
        email = normalised_email(email)
    except ValueError as error:
        raise Invalid.field("email", str(error)) from error
    if repository.user_by_email(session, email) is not None:
        raise Conflict(f"there is a user {email} already")
    if site_id is not None and not repository.existing_sites(session, {site_id}):
        raise Invalid.field("site_id", f"there is no site {site_id}")
    link = AccountLink(kind=LinkKind.INVITATION, email=email, role=role, site_id=site_id)
    token = new_token()
    link.token_sha256, link.expires_at = token_sha256(token), now() + INVITATION_LASTS
    session.add(link)
    return _handed_out(session, access, link, token)


def reset(session: Session, access: Access | None, user: User) -> HandedOut:
    """Make a link with which a person sets a new password; earlier ones of theirs end."""
    if access is not None:
        access.require(Scope.ADMIN, None)
    link, token = fresh_reset(session, user)
    return _handed_out(session, access, link, token)


def open_invitations(session: Session, access: Access) -> list[AccountLink]:
    """Return the invitations nobody has followed yet, to an administrator of all sites."""
    access.require(Scope.ADMIN, None)
    return link_repository.open_invitations(session, now())


def withdraw(session: Session, access: Access, link_id: int) -> None:
    """Make a link worthless. Raises NotFound."""
    access.require(Scope.ADMIN, None)
    link = link_repository.by_id(session, link_id)
    if link is None:
        raise NotFound("there is no such link")
    audit.record(session, access, "withdraw", link.kind.value, link.id, link.site_id)
    session.delete(link)


def look_up(session: Session, token: str) -> AccountLink:
    """Return the link with a token. Raises NotFound when it does not work (any more)."""
    link = link_repository.by_token(session, token_sha256(token), now())
    if link is None:
        raise NotFound(NO_LINK)
    return link


def follow(database: Database, token: str, *, password: str, name: str) -> User:
    """Join, or set the new password; the link is used up in the same transaction.

    Raises NotFound for a link that does not work, Invalid for a weak password.
    """
    with database.reading() as session:
        look_up(session, token)
    passwords.check_password_strength(password)
    with database.writing() as session:
        link = look_up(session, token)
        if not link_repository.use_up(session, link.id, now()):
            raise NotFound(NO_LINK)
        if link.kind is LinkKind.INVITATION:
            return _join(session, link, password, name)
        return _set_password(session, link, password)


def join_from_provider(session: Session, link: AccountLink, name: str) -> User:
    """Let somebody join by an open invitation whose address the identity provider has verified."""
    link_repository.use_up(session, link.id, now())
    return _join(session, link, None, name)


def _handed_out(
    session: Session, access: Access | None, link: AccountLink, token: str
) -> HandedOut:
    link.created_by_id = access.user_id if access else None
    session.flush()
    action = "invite" if link.kind is LinkKind.INVITATION else "hand out"
    details = {} if link.role is None else {"role": link.role.value}
    audit.record(session, access, action, link.kind.value, link.id, link.site_id, **details)
    return HandedOut(link, path_of(token))


def _join(session: Session, link: AccountLink, password: str | None, name: str) -> User:
    role = link.role or Role.VIEWER
    specs = [MembershipSpec(role, link.site_id)]
    return users.create_user(session, link.email, password, specs, name=name)


def _set_password(session: Session, link: AccountLink, password: str) -> User:
    user = None if link.user_id is None else repository.user_by_id(session, link.user_id)
    if user is None or not user.is_active:
        raise NotFound(NO_LINK)
    users.change_user(session, user, users.UserChange(password=password))
    return user
