"""Shapes of retention rules in REST."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field

from app.ids import RowId
from app.tables.live import RetentionKind, RetentionRule


class RuleIn(BaseModel):
    """How long something is kept; a new rule is switched off."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"kind": "images", "keep_days": 365}]}
    )

    kind: RetentionKind
    keep_days: Annotated[int, Field(ge=1, le=36_500)]
    camera_id: Annotated[RowId | None, Field(description="Of this camera only")] = None
    takes_judged: Annotated[
        bool, Field(description="Images too that a person has judged, corrected or completed")
    ] = False


class RuleOut(BaseModel):
    """A rule; `would_go` is what it would let go now."""

    id: int
    site_id: int
    camera_id: int | None
    kind: RetentionKind
    keep_days: int
    takes_judged: bool
    is_active: bool
    applied_at: datetime | None
    applied_count: int | None
    version: int
    would_go: int

    @classmethod
    def of(cls, row: RetentionRule, would_go: int) -> Self:
        """Show a row."""
        names = [name for name in cls.model_fields if name != "would_go"]
        return cls(would_go=would_go, **{name: getattr(row, name) for name in names})
