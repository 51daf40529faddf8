"""SQL of people's identities at providers."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.identity import AccountLink, LinkKind, ProviderIdentity


def by_subject(session: Session, issuer: str, subject: str) -> ProviderIdentity | None:
    """Return the identity with a subject."""
    return session.scalars(
        sa.select(ProviderIdentity).where(
            ProviderIdentity.issuer == issuer, ProviderIdentity.subject == subject
        )
    ).one_or_none()


def of_user(session: Session, user_id: int) -> Sequence[ProviderIdentity]:
    """Return a person's identities."""
    return session.scalars(
        sa.select(ProviderIdentity).where(ProviderIdentity.user_id == user_id)
    ).all()


def linked_users(session: Session) -> set[int]:
    """Return the ids of all people who have an identity at a provider."""
    return set(session.scalars(sa.select(ProviderIdentity.user_id)))


def drop(session: Session, user_id: int) -> int:
    """Forget a person's identities; returns how many there were."""
    gone = session.execute(
        sa.delete(ProviderIdentity)
        .where(ProviderIdentity.user_id == user_id)
        .returning(ProviderIdentity.id)
    )
    return len(gone.all())


def open_invitation(session: Session, email: str, moment: datetime) -> AccountLink | None:
    """Return the newest invitation for an address that still works."""
    return session.scalars(
        sa.select(AccountLink)
        .where(
            AccountLink.kind == LinkKind.INVITATION,
            sa.func.lower(AccountLink.email) == email,
            AccountLink.used_at.is_(None),
            AccountLink.expires_at > moment,
        )
        .order_by(AccountLink.id.desc())
        .limit(1)
    ).first()
