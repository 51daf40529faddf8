"""What is known to be true: boxes drawn by people, and the exact poses of simulated vessels."""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, Json, enum_type, now


class VesselClass(StrEnum):
    """The five classes of the paper's 2D ground truth."""

    SHIP = "ship"
    SHIP_LEAVING_FRAME = "ship_leaving_frame"
    SHIP_MOORED = "ship_moored"
    SHIP_PARTIAL = "ship_partial"
    SUBVESSEL = "subvessel"


class GroundTruthBox(Base):
    """A 2D box by a person, in full-image px; of an image by content, which may be absent here."""

    __tablename__ = "ground_truth_boxes"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    image_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    x1_px: Mapped[float]
    y1_px: Mapped[float]
    x2_px: Mapped[float]
    y2_px: Mapped[float]
    vessel_class: Mapped[VesselClass] = mapped_column(enum_type(VesselClass))
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class VesselTruth(Base):
    """The exact pose of a simulated vessel in an image. Fusion never reads this table."""

    __tablename__ = "vessel_truth"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    identifier: Mapped[str] = mapped_column(sa.String(64))
    mmsi: Mapped[int | None]
    vessel_class: Mapped[VesselClass] = mapped_column(enum_type(VesselClass))
    centroid_in_cam_m: Mapped[list[float]] = mapped_column(Json)
    rotvec_cam_from_vessel: Mapped[list[float]] = mapped_column(Json)
    length_m: Mapped[float]
    width_m: Mapped[float]
    height_m: Mapped[float]
    corners_in_image_px: Mapped[list[list[float]]] = mapped_column(Json)
    visible_fraction: Mapped[float]
    x1_px: Mapped[float]
    y1_px: Mapped[float]
    x2_px: Mapped[float]
    y2_px: Mapped[float]
