"""People: adding, changing and removing them, for administrators and for the command line.

Nobody signs up by themselves and nobody has a default password. Whatever happens, an installation
keeps one active administrator of all sites, for nobody could make another.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session
from sqlalchemy.orm.attributes import flag_modified

from app.auth import audit, passwords, repository
from app.auth.access import Access, Scope
from app.db import now
from app.errors import Conflict, Invalid, NotFound
from app.paging import Paging
from app.tables.identity import Membership, Role, User

_EMAIL = re.compile(r"[^\s@<>\"'()]{1,64}@[^\s@<>\"'()]{1,189}")


@dataclass(frozen=True, slots=True)
class MembershipSpec:
    """A role on one site, or on all sites for None."""

    role: Role
    site_id: int | None = None


@dataclass(frozen=True, slots=True)
class UserChange:
    """What is to change about a person; None leaves it as it is."""

    name: str | None = None
    is_active: bool | None = None
    password: str | None = None
    memberships: Sequence[MembershipSpec] | None = None


def normalised_email(text: str) -> str:
    """Return an address in lower case without blanks around it. Raises ValueError for none."""
    email = text.strip().lower()
    if not _EMAIL.fullmatch(email):
        raise ValueError("is no e-mail address; write it like name@example.org")
    return email


def create_user(
    session: Session,
    email: str,
    password: str | None,
    memberships: Sequence[MembershipSpec],
    *,
    name: str = "",
    access: Access | None = None,
) -> User:
    """Add a person; `access` is who adds them, None for the command line.

    Without a password they sign in at the identity provider only, until they are given one.
    Raises Invalid for a bad address, password or site, Conflict for an address in use.
    """
    try:
        email = normalised_email(email)
    except ValueError as error:
        raise Invalid.field("email", str(error)) from error
    # Hashing first: it is slow, and the first statement takes SQLite's only writer's place.
    password_hash = ""
    if password is not None:
        passwords.check_password_strength(password)
        password_hash = passwords.hash_password(password)
    if repository.user_by_email(session, email) is not None:
        raise Conflict(f"there is a user {email} already")
    user = User(email=email, name=name, password_hash=password_hash)
    user.memberships = _memberships(session, memberships)
    session.add(user)
    session.flush()
    audit.record(
        session, access, "create", "user", user.id, None, email=email, **_roles(memberships)
    )
    return user


def user_for(session: Session, access: Access, user_id: int) -> User:
    """Return a person to an administrator of all sites. Raises Forbidden or NotFound."""
    access.require(Scope.ADMIN, None)
    user = repository.user_by_id(session, user_id)
    if user is None or user.removed_at is not None:
        raise NotFound(f"there is no user {user_id}")
    return user


def user_named(session: Session, email: str) -> User:
    """Return the person with an address, for the command line. Raises NotFound."""
    user = repository.user_by_email(session, email.strip())
    if user is None:
        raise NotFound(f"there is no user {email}")
    return user


def list_users(
    session: Session, access: Access, paging: Paging
) -> tuple[Sequence[User], str | None]:
    """Return a page of all people, to an administrator of all sites. Raises Forbidden."""
    access.require(Scope.ADMIN, None)
    return repository.list_users(session, paging)


def all_users(session: Session) -> Sequence[User]:
    """Return all people by address, for the command line."""
    return repository.all_users(session)


def change_user(
    session: Session, user: User, change: UserChange, *, access: Access | None = None
) -> None:
    """Change a person; a new password or an end of activity ends their browser sessions.

    Raises Invalid for a bad password or site, Conflict when no administrator would be left.
    """
    administered = _administers(user)
    fields = [field for field in ("name", "is_active") if getattr(change, field) is not None]
    for field in fields:
        setattr(user, field, getattr(change, field))
    details: dict[str, object] = {field: getattr(change, field) for field in fields}
    if change.password is not None:
        passwords.check_password_strength(change.password)
        user.password_hash = passwords.hash_password(change.password)
        details["password"] = "changed"  # noqa: S105  that, not what
    if change.memberships is not None:
        # Emptied first: the one-role-for-a-site index sees each statement, not the end.
        user.memberships = []
        session.flush()
        user.memberships = _memberships(session, change.memberships)
        details |= _roles(change.memberships)
    flag_modified(user, "name")  # roles are rows of their own; the version speaks for all
    if administered and not _administers(user):
        _keep_an_administrator(session, user)
    session.flush()
    if change.password is not None or change.is_active is False:
        repository.drop_sessions_of(session, user.id)
    audit.record(session, access, "change", "user", user.id, None, **details)


def goes_with(session: Session, user: User) -> dict[str, int]:
    """Count what goes with a person who is removed; kinds without any are left out."""
    counts = repository.count_lets_in(session, user.id)
    return {words: count for words, count in counts.items() if count}


def remove_user(session: Session, user: User, *, access: Access | None = None) -> None:
    """Remove a person with all that lets them in; their work stays, by "removed reviewer N".

    Address and name are erased for good. Raises Conflict for the last administrator.
    """
    if _administers(user):
        _keep_an_administrator(session, user)
    repository.forget_person(session, user)
    user.memberships = []
    user.email = f"removed-{user.id}@removed.invalid"  # nobody's, and unique
    user.name = f"removed reviewer {user.id}"
    user.password_hash, user.totp_secret = "", None
    user.is_active, user.removed_at = False, now()
    audit.record(session, access, "remove", "user", user.id)
    session.flush()


def with_role(user: User, spec: MembershipSpec) -> list[MembershipSpec]:
    """Return a person's roles with the one for a site (or for all) added or replaced."""
    kept = [
        MembershipSpec(membership.role, membership.site_id)
        for membership in user.memberships
        if membership.site_id != spec.site_id
    ]
    return [*kept, spec]


def change_own_password(session: Session, access: Access, old: str, new: str) -> None:
    """Change the caller's password; all their other browsers are signed out.

    Raises Invalid when the old password does not fit or the new one is too weak.
    """
    passwords.check_password_strength(new)
    new_hash = passwords.hash_password(new)
    user = repository.user_by_id(session, access.user_id)
    if user is None:
        raise NotFound("the caller is gone")
    if not passwords.password_fits(old, user.password_hash):
        raise Invalid.field("old_password", "is not your present password")
    user.password_hash = new_hash
    repository.drop_sessions_of(session, user.id, but=access.session_id)
    audit.record(session, access, "change", "user", user.id, password="changed")  # noqa: S106


def _memberships(session: Session, specs: Sequence[MembershipSpec]) -> list[Membership]:
    sites = [spec.site_id for spec in specs]
    if len(set(sites)) < len(sites):
        raise Invalid.field("memberships", "give one role for each site, and one for all sites")
    wanted = {site_id for site_id in sites if site_id is not None}
    missing = wanted - repository.existing_sites(session, wanted)
    if missing:
        raise Invalid.field("memberships", f"there is no site {min(missing)}")
    return [Membership(role=spec.role, site_id=spec.site_id) for spec in specs]


def _roles(specs: Sequence[MembershipSpec]) -> dict[str, object]:
    return {"roles": [{"role": spec.role.value, "site_id": spec.site_id} for spec in specs]}


def _administers(user: User) -> bool:
    return user.is_active and any(
        membership.role is Role.ADMIN and membership.site_id is None
        for membership in user.memberships
    )


def _keep_an_administrator(session: Session, user: User) -> None:
    if not repository.other_active_admins(session, user.id):
        raise Conflict("this is the last administrator; make another one first")
