"""Making, changing and removing sites and cameras, for whoever may (see actions.py).

A site's origin carries the frame its registrations are expressed in, and a camera's image size is
what its photographs were checked against; both stay as they are once something depends on them.
"""

from collections.abc import Iterable, Sequence

from sqlalchemy.orm import Session

from app.edits import flush_named
from app.errors import Conflict, FieldError, NotFound
from app.paging import Paging
from app.sites import repository
from app.sites.repository import SiteCounts
from app.sites.schemas import CameraIn, CameraPatch, SiteIn, SitePatch
from app.tables.sites import Camera, Site

NO_SITE = "there is no such site"
NO_CAMERA = "there is no such camera"
NO_VIEWPORT = "there is no such viewport"


def get_site(session: Session, site_id: int) -> Site:
    """Return a site. Raises NotFound."""
    site = repository.site(session, site_id)
    if site is None:
        raise NotFound(NO_SITE)
    return site


def get_camera(session: Session, camera_id: int) -> Camera:
    """Return a camera. Raises NotFound."""
    camera = repository.camera(session, camera_id)
    if camera is None:
        raise NotFound(NO_CAMERA)
    return camera


def site_id_of_viewport(session: Session, viewport_id: int) -> int:
    """Return the site a viewport belongs to. Raises NotFound."""
    site_id = repository.site_id_of_viewport(session, viewport_id)
    if site_id is None:
        raise NotFound(NO_VIEWPORT)
    return site_id


def list_sites(
    session: Session, site_ids: frozenset[int] | None, paging: Paging
) -> tuple[Sequence[Site], str | None]:
    """Return a page of the sites among `site_ids` (None: all)."""
    return repository.sites(session, site_ids, paging)


def list_cameras(
    session: Session, site_ids: frozenset[int] | None, site_id: int | None, paging: Paging
) -> tuple[Sequence[Camera], str | None]:
    """Return a page of the cameras of the sites `site_ids` (None: all), or of one among them."""
    return repository.cameras(session, site_ids, site_id, paging)


def site_counts(session: Session, site_ids: Iterable[int]) -> dict[int, SiteCounts]:
    """Count what there is on sites."""
    return repository.site_counts(session, site_ids)


def create_site(session: Session, data: SiteIn) -> Site:
    """Make a site. Raises Conflict when the name is taken."""
    site = Site(
        name=data.name,
        origin_lat_deg=data.origin.lat_deg,
        origin_lon_deg=data.origin.lon_deg,
        origin_height_m=data.origin.height_m,
        water_level_m=data.water_level_m,
        timezone=data.timezone,
        is_simulated=data.is_simulated,
        shows_pseudonyms=data.shows_pseudonyms,
    )
    session.add(site)
    flush_named(session, f"there is already a site named {data.name!r}")
    return site


def update_site(session: Session, site: Site, data: SitePatch) -> Site:
    """Change a site. Raises Conflict for a taken name or an origin that registrations rest on."""
    if data.origin is not None:
        _move_origin(session, site, data)
    for field in ("name", "water_level_m", "timezone", "shows_pseudonyms"):
        value = getattr(data, field)
        if value is not None:
            setattr(site, field, value)
    flush_named(session, f"there is already a site named {site.name!r}")
    return site


def _move_origin(session: Session, site: Site, data: SitePatch) -> None:
    if data.origin is None:
        return
    new = (data.origin.lat_deg, data.origin.lon_deg, data.origin.height_m)
    if new == (site.origin_lat_deg, site.origin_lon_deg, site.origin_height_m):
        return
    count = repository.count_registrations(session, site.id)
    if count:
        raise Conflict(
            f"{count} registrations of this site are expressed in the frame at its origin, so the "
            "origin cannot move; make a new site instead",
            fields=(FieldError("origin", "registrations rest on it"),),
        )
    site.origin_lat_deg, site.origin_lon_deg, site.origin_height_m = new


def create_camera(session: Session, data: CameraIn) -> Camera:
    """Make a camera. Raises NotFound (site), Conflict (name)."""
    site = get_site(session, data.site_id)
    camera = Camera(
        site_id=site.id,
        name=data.name,
        width_px=data.width_px,
        height_px=data.height_px,
        distortion=data.distortion,
        timezone=data.timezone or site.timezone,
        file_name_pattern=data.file_name_pattern,
        **data.pinhole(),
    )
    session.add(camera)
    flush_named(session, f"this site already has a camera named {data.name!r}")
    return camera


def update_camera(session: Session, camera: Camera, data: CameraPatch) -> Camera:
    """Change a camera. Raises Conflict for a taken name or a size its images do not have."""
    size = (data.width_px or camera.width_px, data.height_px or camera.height_px)
    if size != (camera.width_px, camera.height_px):
        count = repository.count_images(session, camera.id)
        if count:
            raise Conflict(
                f"{count} images of this camera are {camera.width_px} x {camera.height_px} px, so "
                "its size cannot change; make another camera for the new size",
                fields=(FieldError("width_px", "images have the present size"),),
            )
    changes = data.model_dump(exclude_unset=True, exclude={"K"}) | data.pinhole()
    for field, value in changes.items():
        if value is not None or field == "file_name_pattern":
            setattr(camera, field, value)
    flush_named(session, f"this site already has a camera named {camera.name!r}")
    return camera


def lock_camera(session: Session, camera_id: int) -> None:
    """Keep others from changing what hangs on a camera until this transaction ends."""
    repository.lock_camera(session, camera_id)
