"""What callers do with retention rules: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.deletions import service as deletions
from app.errors import Invalid, looked_up_by
from app.retention import service
from app.retention.schemas import RuleIn
from app.sites import actions as sites
from app.tables.live import RetentionRule
from app.tables.sites import Site


def add(session: Session, access: Access, site: Site, data: RuleIn) -> RetentionRule:
    """Store a rule of a site, switched off."""
    if data.camera_id is not None:
        with looked_up_by("camera_id"):
            camera = sites.camera_for(session, access, Scope.ADMIN, data.camera_id)
        if camera.site_id != site.id:
            raise Invalid.field("camera_id", "is of another site")
    row = service.add(session, RetentionRule(site_id=site.id, **data.model_dump()))
    record(session, access, "create", "retention rule", row.id, site.id, kind=row.kind.value)
    return row


def rule_for(session: Session, access: Access, rule_id: int) -> RetentionRule:
    """Return a rule of a site the caller administers."""
    row = service.get(session, rule_id)
    access.require(Scope.ADMIN, row.site_id)
    return row


def switch(session: Session, access: Access, rule_id: int, *, on: bool) -> RetentionRule:
    """Switch a rule on or off."""
    row = rule_for(session, access, rule_id)
    row.is_active = on
    session.flush()
    act = "switch on" if on else "switch off"
    record(session, access, act, "retention rule", row.id, row.site_id, keep_days=row.keep_days)
    return row


def remove(session: Session, access: Access, rule_id: int) -> None:
    """Delete a rule for 30 days."""
    row = rule_for(session, access, rule_id)
    record(session, access, "remove", "retention rule", row.id, row.site_id)
    deletions.delete(
        session,
        "retention_rule",
        [row.id],
        site_id=row.site_id,
        label=service.label(row),
        user_id=access.user_id,
    )
