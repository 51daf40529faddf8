"""Places, the cameras that look at them, and where those cameras point."""

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, now
from app.domain.pseudonyms import new_key
from app.tables.deletion import Deletable, index_of_deleted

PRESENT = sa.text("deleted_at IS NULL")  # the name of what was deleted is free again


class Site(Deletable, Base):
    """A place: the origin of its ENU frame and its water level, both ellipsoidal (WGS84).

    With `shows_pseudonyms` only those who may ingest here see who vessels are. The key that makes
    the pseudonyms is read by nobody else than what makes them, and leaves the server never.
    """

    __tablename__ = "sites"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(sa.String(200))
    origin_lat_deg: Mapped[float]
    origin_lon_deg: Mapped[float]
    origin_height_m: Mapped[float] = mapped_column(default=0.0)
    water_level_m: Mapped[float] = mapped_column(default=0.0)
    timezone: Mapped[str] = mapped_column(sa.String(64), default="UTC")
    is_simulated: Mapped[bool] = mapped_column(default=False)
    shows_pseudonyms: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    pseudonym_key: Mapped[bytes] = mapped_column(default=new_key, deferred=True)
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    __table_args__ = (
        sa.Index(
            "uq_sites_name", "name", unique=True, sqlite_where=PRESENT, postgresql_where=PRESENT
        ),
        index_of_deleted("sites"),
    )
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class Camera(Deletable, Base):
    """A camera: image size, intrinsics in px, distortion in OpenCV order (k1 k2 p1 p2 k3)."""

    __tablename__ = "cameras"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(sa.String(200))
    width_px: Mapped[int]
    height_px: Mapped[int]
    fx_px: Mapped[float]
    fy_px: Mapped[float]
    cx_px: Mapped[float]
    cy_px: Mapped[float]
    distortion: Mapped[list[float]]
    timezone: Mapped[str] = mapped_column(sa.String(64), default="UTC")
    file_name_pattern: Mapped[str | None] = mapped_column(sa.String(200))
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    site: Mapped[Site] = relationship()

    __table_args__ = (
        sa.Index(
            "uq_cameras_site_id_name",
            "site_id",
            "name",
            unique=True,
            sqlite_where=PRESENT,
            postgresql_where=PRESENT,
        ),
        index_of_deleted("cameras"),
    )
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way


class Viewport(Deletable, Base):
    """One pointing of a camera, valid from a moment until another (open where empty)."""

    __tablename__ = "viewports"

    id: Mapped[int] = mapped_column(primary_key=True)
    camera_id: Mapped[int] = mapped_column(
        sa.ForeignKey("cameras.id", ondelete="CASCADE"), index=True
    )
    name: Mapped[str] = mapped_column(sa.String(200))
    valid_from: Mapped[datetime | None]
    valid_until: Mapped[datetime | None]
    created_at: Mapped[datetime] = mapped_column(default=now)
    version: Mapped[int] = mapped_column(default=1)

    camera: Mapped[Camera] = relationship()

    __table_args__ = (
        sa.Index(
            "uq_viewports_camera_id_name",
            "camera_id",
            "name",
            unique=True,
            sqlite_where=PRESENT,
            postgresql_where=PRESENT,
        ),
        index_of_deleted("viewports"),
    )
    __mapper_args__ = {"version_id_col": version}  # noqa: RUF012  SQLAlchemy's way
