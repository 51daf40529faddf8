"""Detectors and what they found, keyed by content so that nothing is detected twice."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute, Mapped, mapped_column, relationship

from app.db import Base, enum_type, now
from app.tables.ais import WideId
from app.tables.deletion import DeletableAlone, index_of_deleted, unique_among_present


class ModelStatus(StrEnum):
    """Whether a detector may be used."""

    PROBING = "probing"
    READY = "ready"
    REFUSED = "refused"


class Model(DeletableAlone, Base):
    """A detector: an ONNX file, or a named source of imported detections (family `imported`)."""

    __tablename__ = "models"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(sa.String(200))
    family: Mapped[str] = mapped_column(sa.String(64))
    sha256: Mapped[str] = mapped_column(sa.String(64), index=True)
    size_bytes: Mapped[int]
    status: Mapped[ModelStatus] = mapped_column(enum_type(ModelStatus))
    reason: Mapped[str | None] = mapped_column(sa.Text)
    signature: Mapped[dict[str, Any]] = mapped_column(default=dict)
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )

    __table_args__ = (unique_among_present("models", "name"), index_of_deleted("models"))


class DetectionSet(Base):
    """All that one detector with one setting found in one photograph, maybe nothing."""

    __tablename__ = "detection_sets"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_sha256: Mapped[str] = mapped_column(sa.String(64))
    model_sha256: Mapped[str] = mapped_column(sa.String(64))
    settings_sha256: Mapped[str] = mapped_column(sa.String(64))
    created_at: Mapped[datetime] = mapped_column(default=now)

    detections: Mapped[list["Detection"]] = relationship(
        back_populates="detection_set", order_by="Detection.id"
    )

    __table_args__ = (sa.UniqueConstraint("image_sha256", "model_sha256", "settings_sha256"),)


class Detection(Base):
    """One box in full-image px, with its score."""

    __tablename__ = "detections"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    detection_set_id: Mapped[int] = mapped_column(
        sa.ForeignKey("detection_sets.id", ondelete="CASCADE"), index=True
    )
    x1_px: Mapped[float]
    y1_px: Mapped[float]
    x2_px: Mapped[float]
    y2_px: Mapped[float]
    score: Mapped[float]
    class_id: Mapped[int]

    detection_set: Mapped[DetectionSet] = relationship(back_populates="detections")


# In the order of a `DetectedBox`'s fields.
BOX_COLUMNS: tuple[InstrumentedAttribute[Any], ...] = (
    Detection.x1_px,
    Detection.y1_px,
    Detection.x2_px,
    Detection.y2_px,
    Detection.score,
    Detection.class_id,
)
