"""The audit log: every change leaves a line, in the transaction that made the change."""

from typing import TYPE_CHECKING

from sqlalchemy.orm import Session

from app.tables.identity import AuditEntry

if TYPE_CHECKING:  # commands note their changes without loading the web's framework
    from app.auth.access import Access


def record(
    session: Session,
    access: "Access | None",
    action: str,
    entity: str,
    entity_id: int | None,
    site_id: int | None = None,
    **details: object,
) -> None:
    """Add a line to the audit log.

    `access` is None for what the command line or a worker does. `action` is a verb such as
    "create"; `details` are JSON values and never secrets.
    """
    session.add(
        AuditEntry(
            user_id=access.user_id if access else None,
            action=action,
            entity=entity,
            entity_id=entity_id,
            site_id=site_id,
            details=details,
        )
    )
