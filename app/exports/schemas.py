"""Shapes of exports in REST."""

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from app.db import now
from app.exports.filters import ExportFilters, ExportOptions
from app.tables.exports import Export, ExportStatus


class ExportIn(ExportOptions):
    """What is asked for."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {"format": "coco", "filters": {"run_id": 1, "grade": ["good"]}, "anonymise": True},
                {
                    "format": "kitti",
                    "filters": {"site_id": 1, "from": "2026-06-01T00:00:00Z"},
                    "images": True,
                    "split": {"by": "day", "seed": 7},
                },
            ]
        },
    )

    format: Literal["coco", "bop", "kitti", "bonk", "parquet", "ndjson", "csv"]
    filters: ExportFilters = ExportFilters()
    anonymise: bool = True

    def options(self) -> ExportOptions:
        """Return how the poses are packed."""
        return ExportOptions(images=self.images, archive=self.archive, split=self.split)


class ExportOut(BaseModel):
    """An export and how far it is."""

    id: int
    format: str
    filters: dict[str, Any]
    options: dict[str, Any]
    anonymise: bool
    status: ExportStatus
    error: str | None
    poses: int | None
    poses_total: int | None
    poses_per_s: float | None
    remaining_s: float | None
    sha256: str | None
    size_bytes: int | None
    download_url: str | None
    manifest_url: str | None
    datasheet_url: str | None
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None

    @classmethod
    def of(cls, export: Export) -> "ExportOut":
        """Take the columns of an export."""
        ready = export.status is ExportStatus.SUCCEEDED
        here = f"/api/v1/exports/{export.id}"
        rate, remaining = pace(export)
        return cls(
            id=export.id,
            format=export.format,
            filters=export.filters,
            options=export.options,
            anonymise=export.anonymise,
            status=export.status,
            error=export.error,
            poses=export.item_count,
            poses_total=export.item_total,
            poses_per_s=rate,
            remaining_s=remaining,
            sha256=export.sha256,
            size_bytes=export.size_bytes,
            download_url=f"{here}/download" if ready else None,
            manifest_url=f"{here}/manifest" if ready else None,
            datasheet_url=f"{here}/datasheet" if ready else None,
            created_at=export.created_at,
            started_at=export.started_at,
            finished_at=export.finished_at,
        )


def pace(export: Export) -> tuple[float | None, float | None]:
    """Return poses a second and the seconds that remain; None where it cannot be told."""
    if export.started_at is None or not export.item_count or export.item_total is None:
        return None, None
    taken_s = ((export.finished_at or now()) - export.started_at).total_seconds()
    if taken_s <= 0:
        return None, None
    rate = export.item_count / taken_s
    if export.status is not ExportStatus.RUNNING:
        return rate, None
    return rate, (export.item_total - export.item_count) / rate
