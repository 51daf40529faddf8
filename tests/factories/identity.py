"""Rows of people and of what they prove themselves with."""

from datetime import timedelta
from functools import lru_cache

from sqlalchemy.orm import Session

from app.auth.access import Scope
from app.auth.passwords import hash_password
from app.auth.tokens import new_token, token_sha256
from app.db import now
from app.tables.identity import ApiToken, LoginSession, Membership, Role, User

PASSWORD = "correct horse battery"


@lru_cache(maxsize=1)
def password_hash() -> str:
    """Return the hash of `PASSWORD`, made once since hashing is slow on purpose."""
    return hash_password(PASSWORD)


def make_user(
    session: Session,
    role: Role | str | None = Role.ADMIN,
    site_id: int | None = None,
    *,
    email: str | None = None,
    is_active: bool = True,
) -> User:
    """Insert a person with the password `PASSWORD` and one role; without a role for None."""
    user = User(
        email=email or f"{new_token()[-12:].lower()}@harbour.example",
        name="Test Person",
        password_hash=password_hash(),
        is_active=is_active,
    )
    if role is not None:
        user.memberships.append(Membership(role=Role(role), site_id=site_id))
    session.add(user)
    session.flush()
    return user


def make_token(
    session: Session,
    user: User,
    scopes: tuple[Scope, ...] = tuple(Scope),
    *,
    lives: timedelta = timedelta(days=1),
) -> str:
    """Insert an API token and return its text."""
    text = new_token()
    session.add(
        ApiToken(
            token_sha256=token_sha256(text),
            user_id=user.id,
            name="test",
            scopes=[scope.value for scope in scopes],
            expires_at=now() + lives,
        )
    )
    session.flush()
    return text


def make_login_session(
    session: Session, user: User, *, lives: timedelta = timedelta(hours=1)
) -> str:
    """Insert a browser session and return its cookie."""
    cookie = new_token()
    session.add(
        LoginSession(token_sha256=token_sha256(cookie), user_id=user.id, expires_at=now() + lives)
    )
    session.flush()
    return cookie
