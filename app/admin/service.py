"""Reading the audit log: administrators see their sites' lines, those of all sites see all."""

from collections.abc import Sequence
from dataclasses import replace

from sqlalchemy.orm import Session

from app.admin import repository
from app.admin.repository import AuditFilter
from app.auth.access import Access, Scope
from app.paging import Paging
from app.tables.identity import AuditEntry

__all__ = ["AuditFilter", "emails_of", "list_audit", "user_id_of"]


def list_audit(
    session: Session, access: Access, wanted: AuditFilter, paging: Paging
) -> tuple[Sequence[AuditEntry], str | None]:
    """Return a page of the log that the caller may read, newest first."""
    return repository.list_entries(
        session, replace(wanted, site_ids=access.site_ids(Scope.ADMIN)), paging
    )


def user_id_of(session: Session, email: str) -> int:
    """Return the id of the person with an address; 0, which nobody has, for none."""
    return repository.user_id_of(session, email) or 0


def emails_of(session: Session, user_ids: set[int]) -> dict[int, str]:
    """Return the addresses of people named in the log or on tokens, by their ids."""
    return repository.emails(session, user_ids)
