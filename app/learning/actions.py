"""What callers do with learnt settings: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.learning import service
from app.tables.learning import LearntSettings
from app.tables.sites import Site


def apply(session: Session, access: Access, site: Site, key: str) -> LearntSettings:
    """Make a proposal that a person looked at count for a site's new runs."""
    row = service.apply(session, site.id, key, access.user_id)
    record(
        session,
        access,
        "apply",
        "learnt settings",
        row.id,
        site.id,
        number=row.number,
        settings=row.settings,
    )
    return row


def undo(session: Session, access: Access, learnt_id: int) -> LearntSettings:
    """Take a set back."""
    row = service.get_learnt(session, learnt_id)
    access.require(Scope.REGISTER, row.site_id)
    service.undo(session, row)
    record(session, access, "undo", "learnt settings", row.id, row.site_id, number=row.number)
    return row
