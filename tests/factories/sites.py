"""Rows of sites, cameras and viewports."""

from datetime import datetime
from itertools import count

from sqlalchemy.orm import Session

from app.tables.sites import Camera, Site, Viewport

_number = count(1)


def make_site(session: Session, name: str | None = None, **columns: object) -> Site:
    """Insert a site on the Elbe."""
    values: dict[str, object] = {
        "name": name or f"Site {next(_number)}",
        "origin_lat_deg": 53.5422,
        "origin_lon_deg": 9.9835,
        "origin_height_m": 40.0,
        "water_level_m": 40.0,
        "timezone": "Europe/Berlin",
    }
    site = Site(**(values | columns))
    session.add(site)
    session.flush()
    return site


def make_camera(session: Session, site: Site, name: str | None = None, **columns: object) -> Camera:
    """Insert a camera of 64 x 48 px."""
    values: dict[str, object] = {
        "site_id": site.id,
        "name": name or f"Camera {next(_number)}",
        "width_px": 64,
        "height_px": 48,
        "fx_px": 60.0,
        "fy_px": 60.0,
        "cx_px": 31.5,
        "cy_px": 23.5,
        "distortion": [0.0] * 5,
        "timezone": "Europe/Berlin",
    }
    camera = Camera(**(values | columns))
    session.add(camera)
    session.flush()
    return camera


def make_viewport(
    session: Session,
    camera: Camera,
    name: str | None = None,
    *,
    valid_from: datetime | None = None,
    valid_until: datetime | None = None,
) -> Viewport:
    """Insert a viewport."""
    viewport = Viewport(
        camera_id=camera.id,
        name=name or f"Viewport {next(_number)}",
        valid_from=valid_from,
        valid_until=valid_until,
    )
    session.add(viewport)
    session.flush()
    return viewport
