"""SQL of people, sessions and tokens."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.paging import Paging, fetch_page
from app.tables.identity import (
    AccountLink,
    ApiToken,
    AuditEntry,
    IdempotencyKey,
    LoginSession,
    Membership,
    ProviderIdentity,
    RecoveryCode,
    Role,
    User,
)
from app.tables.sites import Site


def user_by_id(session: Session, user_id: int) -> User | None:
    """Return a user, or None."""
    return session.get(User, user_id)


def user_by_email(session: Session, email: str) -> User | None:
    """Return the user with an address, whatever its case, or None."""
    return session.scalars(
        sa.select(User).where(sa.func.lower(User.email) == email.lower())
    ).one_or_none()


@dataclass(frozen=True, slots=True)
class Credential:
    """A session or token that is in force, with the person it stands for and their roles."""

    id: int
    user_id: int
    email: str
    name: str
    is_active: bool
    roles: Mapping[int | None, Role]
    scopes: Sequence[str] = ()
    last_used_at: datetime | None = None
    camera_id: int | None = None


# These two are asked at every request, so they are put together once and read no objects.
_PERSON = (
    User.id,
    User.email,
    User.name,
    User.is_active,
    Membership.site_id,
    Membership.role,
)
# Who owes a second factor may do nothing before it is set up.
_OWES_FACTOR = User.totp_required & User.totp_secret.is_(None)
_OF_SESSION = (
    sa.select(LoginSession.id, _OWES_FACTOR & ~LoginSession.factor_shown, *_PERSON)
    .join(User, User.id == LoginSession.user_id)
    .outerjoin(Membership, Membership.user_id == User.id)
    .where(
        LoginSession.token_sha256 == sa.bindparam("sha256"),
        LoginSession.expires_at > sa.bindparam("moment"),
        ~LoginSession.awaits_code,
    )
)
_OF_TOKEN = (
    sa.select(
        ApiToken.id,
        _OWES_FACTOR,
        *_PERSON,
        ApiToken.scopes,
        ApiToken.last_used_at,
        ApiToken.camera_id,
    )
    .join(User, User.id == ApiToken.user_id)
    .outerjoin(Membership, Membership.user_id == User.id)
    .where(
        ApiToken.token_sha256 == sa.bindparam("sha256"),
        ApiToken.expires_at > sa.bindparam("moment"),
        ApiToken.revoked_at.is_(None),
    )
)


def credential_of_session(session: Session, sha256: str, moment: datetime) -> Credential | None:
    """Return whose unexpired browser session this is, or None."""
    rows = session.execute(_OF_SESSION, {"sha256": sha256, "moment": moment}).all()
    return _credential([tuple(row) for row in rows]) if rows else None


def credential_of_token(session: Session, sha256: str, moment: datetime) -> Credential | None:
    """Return whose unexpired, unrevoked API token this is, or None."""
    rows = session.execute(_OF_TOKEN, {"sha256": sha256, "moment": moment}).all()
    return _credential([tuple(row) for row in rows]) if rows else None


def _credential(rows: Sequence[tuple[Any, ...]]) -> Credential:
    """Put the rows of one credential together: one for each role of the person."""
    identifier, owes_factor, user_id, email, name, is_active, _, _, *token = rows[0]
    roles = {row[6]: row[7] for row in rows if row[7] is not None and not owes_factor}
    return Credential(identifier, user_id, email, name, is_active, roles, *token)


def list_users(session: Session, paging: Paging) -> tuple[Sequence[User], str | None]:
    """Return a page of all users."""
    return fetch_page(session, sa.select(User).where(User.removed_at.is_(None)), User.id, paging)


def all_users(session: Session) -> Sequence[User]:
    """Return all people by address."""
    return session.scalars(
        sa.select(User).where(User.removed_at.is_(None)).order_by(User.email)
    ).all()


def forget_person(session: Session, user: User) -> None:
    """Remove all that lets a person in, and their address from the audit log's details."""
    lets_in = (LoginSession, ApiToken, AccountLink, RecoveryCode, ProviderIdentity)
    for table in (*lets_in, IdempotencyKey):
        session.execute(sa.delete(table).where(table.user_id == user.id))
    session.execute(sa.delete(AccountLink).where(AccountLink.email == user.email))
    about = sa.select(AuditEntry).where(
        AuditEntry.entity == "user", AuditEntry.entity_id == user.id
    )
    for entry in session.scalars(about):
        entry.details = {key: value for key, value in entry.details.items() if key != "email"}


def count_lets_in(session: Session, user_id: int) -> dict[str, int]:
    """Count what lets a person in and goes with them, in words for people."""
    return {
        words: session.scalar(
            sa.select(sa.func.count()).select_from(table).where(table.user_id == user_id)
        )
        or 0
        for words, table in (
            ("roles", Membership),
            ("tokens for scripts", ApiToken),
            ("signed-in browsers", LoginSession),
            ("accounts at identity providers", ProviderIdentity),
        )
    }


def list_tokens(
    session: Session, user_id: int | None, paging: Paging
) -> tuple[Sequence[ApiToken], str | None]:
    """Return a page of the tokens of one user, or of all with None."""
    statement = sa.select(ApiToken)
    if user_id is not None:
        statement = statement.where(ApiToken.user_id == user_id)
    return fetch_page(session, statement, ApiToken.id, paging)


def token_by_id(session: Session, token_id: int) -> ApiToken | None:
    """Return a token, or None."""
    return session.get(ApiToken, token_id)


def with_what_it_made(session: Session, token: ApiToken) -> Sequence[ApiToken]:
    """Return a token, the tokens it made, those they made, and so on."""
    family = sa.select(ApiToken.id).where(ApiToken.id == token.id).cte("family", recursive=True)
    family = family.union(sa.select(ApiToken.id).where(ApiToken.made_by_id == family.c.id))
    return session.scalars(
        sa.select(ApiToken).where(ApiToken.id.in_(sa.select(family.c.id))).order_by(ApiToken.id)
    ).all()


def note_token_use(session: Session, token_id: int, moment: datetime) -> None:
    """Store when a token was last used."""
    session.execute(sa.update(ApiToken).where(ApiToken.id == token_id).values(last_used_at=moment))


def drop_session(session: Session, session_id: int) -> None:
    """End a browser's session."""
    session.execute(sa.delete(LoginSession).where(LoginSession.id == session_id))


def drop_sessions_of(session: Session, user_id: int, *, but: int | None = None) -> None:
    """End all of a user's browser sessions, but one where it is named."""
    statement = sa.delete(LoginSession).where(LoginSession.user_id == user_id)
    if but is not None:
        statement = statement.where(LoginSession.id != but)
    session.execute(statement)


def drop_expired_sessions(session: Session, moment: datetime) -> None:
    """Forget the sessions that nobody can use any more."""
    session.execute(sa.delete(LoginSession).where(LoginSession.expires_at <= moment))


def other_active_admins(session: Session, user_id: int) -> int:
    """Count the active administrators of all sites besides a user, locking them on Postgres."""
    rows = session.scalars(
        sa.select(User.id)
        .join(Membership, Membership.user_id == User.id)
        .where(
            User.id != user_id,
            User.is_active,
            Membership.role == Role.ADMIN,
            Membership.site_id.is_(None),
        )
        .with_for_update()
    ).all()
    return len(rows)


def administrators(session: Session, site_id: int | None) -> Sequence[User]:
    """Return the active administrators of a site and of all sites; for None only the latter."""
    of_all = Membership.site_id.is_(None)
    return session.scalars(
        sa.select(User)
        .join(User.memberships)
        .where(
            User.is_active,
            User.removed_at.is_(None),
            Membership.role == Role.ADMIN,
            of_all if site_id is None else sa.or_(of_all, Membership.site_id == site_id),
        )
        .distinct()
        .order_by(User.id)
    ).all()


def existing_sites(session: Session, site_ids: set[int]) -> set[int]:
    """Return which of the site ids exist."""
    return set(session.scalars(sa.select(Site.id).where(Site.id.in_(site_ids))).all())


def idempotency_key(session: Session, user_id: int, key: str) -> IdempotencyKey | None:
    """Return what was answered to a user's request with this key, or None."""
    return session.scalars(
        sa.select(IdempotencyKey).where(
            IdempotencyKey.user_id == user_id, IdempotencyKey.key == key
        )
    ).one_or_none()


def drop_idempotency_keys(session: Session, *, before: datetime) -> None:
    """Forget the answers given before a moment."""
    session.execute(sa.delete(IdempotencyKey).where(IdempotencyKey.created_at < before))


def site_id_named(session: Session, text: str) -> int | None:
    """Return the id of the site with a name or, for a number, with that id; None for none."""
    is_id = text.isascii() and text.isdigit()
    wanted = Site.name == text
    return session.scalars(
        sa.select(Site.id)
        .where(sa.or_(wanted, Site.id == int(text)) if is_id else wanted)
        .order_by(wanted.desc())
        .limit(1)
    ).first()


def site_names(session: Session, site_ids: set[int] | None = None) -> dict[int, str]:
    """Return sites' names by their ids; of all sites without ids."""
    statement = sa.select(Site).order_by(Site.name)
    if site_ids is not None:
        statement = statement.where(Site.id.in_(site_ids))
    return {site.id: site.name for site in session.scalars(statement)}
