"""Named world points, where a viewport sees them, and the cameras solved from them."""

from datetime import datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, Json, enum_type, now
from app.tables.deletion import DeletableAlone, index_of_deleted, unique_among_present
from app.tables.sites import Viewport


class KeypointRole(StrEnum):
    """What a keypoint is used for."""

    CONTROL = "control"  # enters the solution
    CHECK = "check"  # only judges it
    OFF = "off"


class RegistrationMethod(StrEnum):
    """How a camera's pose came about (paper, coordinate transformation)."""

    PNP = "pnp"
    HOMOGRAPHY_WATER = "homography_water"
    HOMOGRAPHY_PCA = "homography_pca"
    GIVEN = "given"
    ROTATION = "rotation"  # another registration, turned by what photographs show


class Landmark(DeletableAlone, Base):
    """A named world point (WGS84, ellipsoidal height), shared by all viewports of a site."""

    __tablename__ = "landmarks"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(sa.String(200))
    lat_deg: Mapped[float]
    lon_deg: Mapped[float]
    height_m: Mapped[float]
    version: Mapped[int] = mapped_column(default=1, server_default="1")

    __table_args__ = (
        unique_among_present("landmarks", "site_id", "name"),
        index_of_deleted("landmarks"),
    )
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class Keypoint(Base):
    """A landmark seen in a viewport at (u, v) px."""

    __tablename__ = "keypoints"

    id: Mapped[int] = mapped_column(primary_key=True)
    viewport_id: Mapped[int] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="CASCADE"), index=True
    )
    landmark_id: Mapped[int] = mapped_column(
        sa.ForeignKey("landmarks.id", ondelete="CASCADE"), index=True
    )
    u_px: Mapped[float]
    v_px: Mapped[float]
    role: Mapped[KeypointRole] = mapped_column(
        enum_type(KeypointRole), default=KeypointRole.CONTROL
    )

    landmark: Mapped[Landmark] = relationship(lazy="joined")

    __table_args__ = (sa.UniqueConstraint("viewport_id", "landmark_id"),)


class Registration(Base):
    """One solution for a viewport; never changed, so that poses can point to it.

    `rotation` is the Rodrigues vector of cam_from_enu in the site's ENU frame; the centre is
    WGS84 with ellipsoidal height. `intrinsics` are those in force (refined ones included):
    width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion. Homographies have a `homography`
    instead of a pose. `provenance` says of a rotation what it rests on: from_registration_id,
    reregistration_id, pointing_id, keyframe_image_ids, image_count, inliers, angle_deg.
    """

    __tablename__ = "registrations"

    id: Mapped[int] = mapped_column(primary_key=True)
    viewport_id: Mapped[int] = mapped_column(
        sa.ForeignKey("viewports.id", ondelete="CASCADE"), index=True
    )
    method: Mapped[RegistrationMethod] = mapped_column(enum_type(RegistrationMethod))
    rotation: Mapped[list[float] | None] = mapped_column(Json)
    center_lat_deg: Mapped[float | None]
    center_lon_deg: Mapped[float | None]
    center_height_m: Mapped[float | None]
    intrinsics: Mapped[dict[str, Any]]
    homography: Mapped[list[list[float]] | None] = mapped_column(Json)
    covariance: Mapped[list[list[float]] | None] = mapped_column(Json)
    mae_px: Mapped[float | None]
    mae_pct_width: Mapped[float | None]
    mae_pct_height: Mapped[float | None]
    leave_one_out_px: Mapped[float | None]
    residuals: Mapped[list[Any]] = mapped_column(default=list)
    warnings: Mapped[list[str]] = mapped_column(default=list)
    provenance: Mapped[dict[str, Any] | None] = mapped_column(Json)
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )

    viewport: Mapped[Viewport] = relationship()
