"""Shapes of deletions in REST."""

from datetime import datetime
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from app.deletions import service
from app.tables.deletion import Deletion

Entity = Literal[
    "site",
    "camera",
    "viewport",
    "run",
    "image",
    "ais_file",
    "calibration_set",
    "comment",
    "feed",
    "ground_truth_file",
    "landmark",
    "missed_vessel",
    "model",
    "retention_rule",
    "review_queue",
    "standing_run",
    "watched_folder",
    "water_levels",
]


class ExtentOut(BaseModel):
    """What would go along with something that is deleted, counted by kind."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"entity": "run", "id": 4, "counts": {"poses": 112}}]}
    )

    entity: Entity
    id: int
    counts: dict[str, int]
    stale_runs: int = Field(
        default=0, description="Runs that placed vessels by a recording; their poses stay"
    )


class DeletionOut(BaseModel):
    """Something that was deleted with what belongs to it, and until when it can come back."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": 3,
                    "entity": "camera",
                    "entity_id": 2,
                    "site_id": 1,
                    "label": "Camera Gable",
                    "counts": {"images": 40, "viewports": 2},
                    "deleted_at": "2026-11-22T10:00:05Z",
                    "gone_at": "2026-12-22T10:00:05Z",
                }
            ]
        }
    )

    id: int
    entity: str
    entity_id: int | None
    site_id: int | None = Field(description="null: of all sites")
    label: str
    counts: dict[str, int]
    deleted_at: datetime
    gone_at: datetime

    @classmethod
    def of(cls, deletion: Deletion) -> Self:
        """Show a row."""
        names = [name for name in cls.model_fields if name != "gone_at"]
        return cls(
            gone_at=service.gone_at(deletion), **{name: getattr(deletion, name) for name in names}
        )
