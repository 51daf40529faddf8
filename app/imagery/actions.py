"""What callers do with images: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.deletions import actions as deletions
from app.imagery import service
from app.imagery.service import Upload
from app.sites import actions as sites
from app.storage import Storage
from app.tables.imagery import Image


def image_for(session: Session, access: Access, scope: Scope, image_id: int) -> Image:
    """Return an image on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    image = service.get_image(session, image_id)
    access.require(scope, image.site_id)
    return image


def upload_image(
    database: Database,
    storage: Storage,
    settings: Settings,
    access: Access,
    camera_id: int,
    upload: Upload,
) -> tuple[Image, bool]:
    """Take a photograph in; returns its image and whether it is new.

    Opens its own sessions: a read for the camera, and a write once all slow work is done.
    """
    with database.reading() as session:
        camera = sites.camera_for(session, access, Scope.INGEST, camera_id)
        known = service.known_image(session, camera, upload)
    if known is not None:
        return known, False
    incoming = service.take_in(storage, settings, camera, upload)
    with database.writing() as session:
        image, created = service.remember(session, incoming)
        action = "create" if created else "restore"
        record(session, access, action, "image", image.id, image.site_id, sha256=image.sha256)
    return image, created


def delete_image(session: Session, access: Access, image: Image) -> None:
    """Delete an image with its poses, for 30 days."""
    deletions.delete(session, access, "image", image.id, image.site_id, image.file_name)
