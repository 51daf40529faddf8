"""What callers do with sites and cameras: the permission, the change and the audit line together.

REST and the pages both go through here. The command line, the demo and the worker, who act for
nobody in particular, use service.py.
"""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.deletions import actions as deletions
from app.sites import service
from app.sites.schemas import CameraIn, CameraPatch, SiteIn, SitePatch
from app.tables.sites import Camera, Site


def site_for(session: Session, access: Access, scope: Scope, site_id: int) -> Site:
    """Return a site on which the caller holds a scope. Raises NotFound, Forbidden."""
    site = service.get_site(session, site_id)
    access.require(scope, site.id)
    return site


def camera_for(session: Session, access: Access, scope: Scope, camera_id: int) -> Camera:
    """Return a camera on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    camera = service.get_camera(session, camera_id)
    access.require(scope, camera.site_id)
    return camera


def create_site(session: Session, access: Access, data: SiteIn) -> Site:
    """Make a site; that takes the scope `register` on all sites."""
    access.require(Scope.REGISTER, None)
    site = service.create_site(session, data)
    record(session, access, "create", "site", site.id, site.id, name=site.name)
    return site


def update_site(session: Session, access: Access, site: Site, data: SitePatch) -> Site:
    """Change a site."""
    service.update_site(session, site, data)
    changes = data.model_dump(mode="json", exclude_unset=True)
    record(session, access, "update", "site", site.id, site.id, changes=changes)
    return site


def delete_site(session: Session, access: Access, site: Site) -> None:
    """Delete a site with all that belongs to it, for 30 days."""
    deletions.delete(session, access, "site", site.id, site.id, site.name)


def create_camera(session: Session, access: Access, data: CameraIn) -> Camera:
    """Make a camera of a site the caller may register."""
    site_for(session, access, Scope.REGISTER, data.site_id)
    camera = service.create_camera(session, data)
    record(session, access, "create", "camera", camera.id, camera.site_id, name=camera.name)
    return camera


def update_camera(session: Session, access: Access, camera: Camera, data: CameraPatch) -> Camera:
    """Change a camera."""
    service.update_camera(session, camera, data)
    changes = data.model_dump(mode="json", exclude_unset=True)
    record(session, access, "update", "camera", camera.id, camera.site_id, changes=changes)
    return camera


def delete_camera(session: Session, access: Access, camera: Camera) -> None:
    """Delete a camera with all that belongs to it, for 30 days."""
    deletions.delete(session, access, "camera", camera.id, camera.site_id, camera.name)
