"""Answers of detectors."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from app.tables.detection import ModelStatus


class ModelOut(BaseModel):
    """A detector."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    name: str
    family: str = Field(
        description="What its inputs and outputs mean: yolox, yolov3, detr, deformable-detr, "
        "deformable-detr-two-stage, cascade-rcnn; auto while the worker is yet to tell; "
        "imported: boxes that came from elsewhere"
    )
    sha256: str
    size_bytes: int
    status: ModelStatus
    reason: str | None = Field(description="Why it was refused")
    signature: dict[str, Any] = Field(description="What the model takes and gives")
    created_at: datetime


class ImportedDetectionsOut(BaseModel):
    """Imported detections: the model that stands for their source, and what came in."""

    model: ModelOut
    images: int = Field(description="Images that have a set of boxes now, maybe an empty one")
    detections: int
    ignored: int = Field(description="Boxes of categories that are no vessels")
    without_area: int = Field(
        description="Boxes without width or height: false detections, which runs pass over"
    )
    notes: list[str] = Field(description="What somebody may not expect of the file")
