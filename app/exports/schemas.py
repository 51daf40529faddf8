"""Shapes of exports in REST."""

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from app.exports.filters import ExportFilters
from app.tables.exports import Export, ExportStatus


class ExportIn(BaseModel):
    """What is asked for."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {"format": "coco", "filters": {"run_id": 1, "grade": ["good"]}, "anonymise": True}
            ]
        },
    )

    format: Literal["coco", "ndjson"]
    filters: ExportFilters = ExportFilters()
    anonymise: bool = True


class ExportOut(BaseModel):
    """An export and how far it is."""

    id: int
    format: str
    filters: dict[str, Any]
    anonymise: bool
    status: ExportStatus
    error: str | None
    poses: int | None
    sha256: str | None
    size_bytes: int | None
    download_url: str | None
    created_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, export: Export) -> "ExportOut":
        """Take the columns of an export."""
        ready = export.status is ExportStatus.SUCCEEDED
        return cls(
            id=export.id,
            format=export.format,
            filters=export.filters,
            anonymise=export.anonymise,
            status=export.status,
            error=export.error,
            poses=export.item_count,
            sha256=export.sha256,
            size_bytes=export.size_bytes,
            download_url=f"/api/v1/exports/{export.id}/download" if ready else None,
            created_at=export.created_at,
            finished_at=export.finished_at,
        )
