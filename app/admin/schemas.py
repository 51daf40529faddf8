"""What REST says about the audit log."""

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel

from app.tables.identity import AuditEntry


class AuditOut(BaseModel):
    """One change: when, who, what, on what."""

    id: int
    at: datetime
    user_id: int | None
    action: str
    entity: str
    entity_id: int | None
    site_id: int | None
    details: dict[str, Any]

    @classmethod
    def of(cls, entry: AuditEntry) -> Self:
        """Return what REST says about a stored line."""
        return cls(
            id=entry.id,
            at=entry.at,
            user_id=entry.user_id,
            action=entry.action,
            entity=entry.entity,
            entity_id=entry.entity_id,
            site_id=entry.site_id,
            details=entry.details,
        )
