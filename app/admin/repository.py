"""SQL of the audit log."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.paging import Paging, encode_cursor
from app.tables.identity import AuditEntry, User


@dataclass(frozen=True, slots=True)
class AuditFilter:
    """Which lines are wanted; None leaves a field open."""

    user_id: int | None = None
    entity: str | None = None
    entity_id: int | None = None
    action: str | None = None
    site_id: int | None = None
    since: datetime | None = None
    until: datetime | None = None
    site_ids: frozenset[int] | None = None


def list_entries(
    session: Session, wanted: AuditFilter, paging: Paging
) -> tuple[Sequence[AuditEntry], str | None]:
    """Return a page of the log, newest first, and the next cursor."""
    statement = sa.select(AuditEntry).order_by(AuditEntry.id.desc()).limit(paging.limit + 1)
    for column, value in (
        (AuditEntry.user_id, wanted.user_id),
        (AuditEntry.entity, wanted.entity),
        (AuditEntry.entity_id, wanted.entity_id),
        (AuditEntry.action, wanted.action),
        (AuditEntry.site_id, wanted.site_id),
    ):
        if value is not None:
            statement = statement.where(column == value)
    if wanted.since is not None:
        statement = statement.where(AuditEntry.at >= wanted.since)
    if wanted.until is not None:
        statement = statement.where(AuditEntry.at < wanted.until)
    if wanted.site_ids is not None:
        statement = statement.where(AuditEntry.site_id.in_(wanted.site_ids))
    if paging.after is not None:
        statement = statement.where(AuditEntry.id < paging.after)
    rows = session.scalars(statement).all()
    if len(rows) <= paging.limit:
        return rows, None
    rows = rows[: paging.limit]
    return rows, encode_cursor(rows[-1].id)


def emails(session: Session, user_ids: set[int]) -> dict[int, str]:
    """Return people's addresses by their ids."""
    users = session.scalars(sa.select(User).where(User.id.in_(user_ids)))
    return {user.id: user.email for user in users}


def user_id_of(session: Session, email: str) -> int | None:
    """Return the id of the person with an address, whatever its case."""
    wanted = sa.func.lower(User.email) == email.strip().lower()
    return session.scalars(sa.select(User.id).where(wanted)).one_or_none()
