"""What is known to be true: boxes drawn by people, and the exact poses of simulated vessels."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.deletion import DeletableAlone, index_of_deleted, unique_among_present


class VesselClass(StrEnum):
    """The five classes of the paper's 2D ground truth."""

    SHIP = "ship"
    SHIP_LEAVING_FRAME = "ship_leaving_frame"
    SHIP_MOORED = "ship_moored"
    SHIP_PARTIAL = "ship_partial"
    SUBVESSEL = "subvessel"


class GroundTruthFile(DeletableAlone, Base):
    """A COCO file of boxes that was imported.

    `document` is the file without its images and annotations, so that it can go out as it came;
    `class_of_category` is what a person said its categories are, by category id.
    """

    __tablename__ = "ground_truth_files"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"))
    sha256: Mapped[str] = mapped_column(sa.String(64))
    file_name: Mapped[str] = mapped_column(sa.String(255))
    document: Mapped[dict[str, Any]]
    class_of_category: Mapped[dict[str, Any]]
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )

    __table_args__ = (
        unique_among_present("ground_truth_files", "site_id", "sha256"),
        index_of_deleted("ground_truth_files"),
    )


class GroundTruthImage(DeletableAlone, Base):
    """A photograph that people drew boxes in; it may be absent here, known by its file's name.

    `content_sha256` is the key that detections of it are stored under: the photograph's hash, or a
    stand-in while it is absent. `is_complete` says that every vessel has its box: only then does a
    detection without one count as wrong. `version` grows with every change, of its boxes too.
    `entry` is the image's entry in the file it came with.
    """

    __tablename__ = "ground_truth_images"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"))
    image_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("images.id", ondelete="SET NULL"), index=True
    )
    file_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("ground_truth_files.id", ondelete="CASCADE"), index=True
    )
    file_name: Mapped[str] = mapped_column(sa.String(1000))
    base_name: Mapped[str] = mapped_column(sa.String(255), index=True)
    width_px: Mapped[int]
    height_px: Mapped[int]
    content_sha256: Mapped[str] = mapped_column(sa.String(64), index=True)
    coco_id: Mapped[int | None] = mapped_column(sa.BigInteger)
    entry: Mapped[dict[str, Any] | None] = mapped_column(Json)
    is_complete: Mapped[bool] = mapped_column(default=False)
    completed_at: Mapped[datetime | None]
    completed_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way
    __table_args__ = (
        sa.Index("ix_ground_truth_images_site", "site_id", "id"),
        unique_among_present("ground_truth_images", "image_id"),
        index_of_deleted("ground_truth_images"),
    )


class GroundTruthBox(Base):
    """A 2D box by a person, px from the image's edge; deleted ones stay to be brought back.

    `area_px2` is what the file says (a mask's area is less than its box's). `entry` is the box's
    annotation in the file it came with.
    """

    __tablename__ = "ground_truth_boxes"

    id: Mapped[int] = mapped_column(primary_key=True)
    ground_truth_image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("ground_truth_images.id", ondelete="CASCADE"), index=True
    )
    x1_px: Mapped[float]
    y1_px: Mapped[float]
    x2_px: Mapped[float]
    y2_px: Mapped[float]
    area_px2: Mapped[float]
    is_crowd: Mapped[bool] = mapped_column(default=False)
    vessel_class: Mapped[VesselClass] = mapped_column(enum_type(VesselClass))
    coco_id: Mapped[int | None] = mapped_column(sa.BigInteger)
    entry: Mapped[dict[str, Any] | None] = mapped_column(Json)
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    created_at: Mapped[datetime] = mapped_column(default=now)
    deleted_at: Mapped[datetime | None]
    version: Mapped[int] = mapped_column(default=1)

    image: Mapped[GroundTruthImage] = relationship()

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
