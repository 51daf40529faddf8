"""SQL of invitations, password resets, recovery codes and browsers that are signed in."""

from collections.abc import Iterable, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.tables.identity import AccountLink, LinkKind, LoginSession, RecoveryCode


def by_id(session: Session, link_id: int) -> AccountLink | None:
    """Return a link."""
    return find(session, AccountLink, link_id)


def by_token(session: Session, sha256: str, moment: datetime) -> AccountLink | None:
    """Return the link with a token that is neither used nor expired."""
    return session.scalars(
        sa.select(AccountLink).where(
            sa.or_(AccountLink.token_sha256 == sha256, AccountLink.mailed_sha256 == sha256),
            AccountLink.used_at.is_(None),
            AccountLink.expires_at > moment,
        )
    ).one_or_none()


def use_up(session: Session, link_id: int, moment: datetime) -> bool:
    """Mark a link as used; False when somebody else has just done so."""
    used = session.execute(
        sa.update(AccountLink)
        .where(AccountLink.id == link_id, AccountLink.used_at.is_(None))
        .values(used_at=moment)
        .returning(AccountLink.id)
    ).first()
    return used is not None


def open_invitations(session: Session, moment: datetime) -> list[AccountLink]:
    """Return the invitations that still work, the newest first."""
    statement = (
        sa.select(AccountLink)
        .where(
            AccountLink.kind == LinkKind.INVITATION,
            AccountLink.used_at.is_(None),
            AccountLink.expires_at > moment,
        )
        .order_by(AccountLink.id.desc())
    )
    return list(session.scalars(statement))


def drop_resets(session: Session, user_id: int) -> None:
    """End a person's links for a new password."""
    session.execute(sa.delete(AccountLink).where(AccountLink.user_id == user_id))


def sessions_of(session: Session, user_id: int, moment: datetime) -> Sequence[LoginSession]:
    """Return the browsers where a person is signed in, the newest first."""
    return session.scalars(
        sa.select(LoginSession)
        .where(
            LoginSession.user_id == user_id,
            LoginSession.expires_at > moment,
            ~LoginSession.awaits_code,
        )
        .order_by(LoginSession.id.desc())
    ).all()


def waiting_session(session: Session, sha256: str, moment: datetime) -> LoginSession | None:
    """Return the session of a browser that has shown the password and owes the code."""
    return session.scalars(
        sa.select(LoginSession).where(
            LoginSession.token_sha256 == sha256,
            LoginSession.expires_at > moment,
            LoginSession.awaits_code,
        )
    ).one_or_none()


def replace_recovery_codes(session: Session, user_id: int, sha256s: Iterable[str]) -> None:
    """Store a person's recovery codes in the place of the earlier ones."""
    session.execute(sa.delete(RecoveryCode).where(RecoveryCode.user_id == user_id))
    session.add_all(RecoveryCode(user_id=user_id, code_sha256=sha256) for sha256 in sha256s)


def use_recovery_code(session: Session, user_id: int, sha256: str, moment: datetime) -> bool:
    """Use a recovery code up; False when there is none like it."""
    used = session.execute(
        sa.update(RecoveryCode)
        .where(
            RecoveryCode.user_id == user_id,
            RecoveryCode.code_sha256 == sha256,
            RecoveryCode.used_at.is_(None),
        )
        .values(used_at=moment)
        .returning(RecoveryCode.id)
    ).first()
    return used is not None


def count_recovery_codes(session: Session, user_id: int) -> int:
    """Count the recovery codes that a person has left."""
    left = RecoveryCode.used_at.is_(None)
    statement = sa.select(sa.func.count()).where(RecoveryCode.user_id == user_id, left)
    return session.scalar(statement) or 0
