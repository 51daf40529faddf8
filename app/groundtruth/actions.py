"""What callers do with ground truth: the permission, the change and the audit line together."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import UploadFile
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.deletions import service as deletions
from app.errors import Invalid, TooLarge
from app.groundtruth import importing, service
from app.groundtruth.coco_file import CocoFile, read_coco
from app.groundtruth.importing import ImportChoices, Imported, Looked
from app.sites import service as sites
from app.tables.groundtruth import GroundTruthBox, GroundTruthFile, GroundTruthImage, VesselClass


@dataclass(frozen=True, slots=True)
class Sent:
    """An uploaded file, read and checked."""

    name: str
    sha256: str
    data: bytes
    file: CocoFile


def receive(upload: UploadFile, settings: Settings) -> Sent:
    """Read an uploaded file; no SQL yet. Raises Invalid, TooLarge."""
    data = upload.file.read(settings.max_upload_bytes + 1)
    if len(data) > settings.max_upload_bytes:
        raise TooLarge(f"at most {settings.max_upload_bytes} bytes are taken here")
    name = (upload.filename or "boxes.json").replace("\\", "/").rpartition("/")[2]
    return Sent(name, importing.sha256_of(data), data, read_coco(data))


def said_of(text: str) -> Mapping[str, str]:
    """Read `{"boat": "ship"}`: what categories are, by name or id. Raises Invalid."""
    if not text.strip():
        return {}
    try:
        return {str(name): str(value) for name, value in json.loads(text).items()}
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise Invalid.field(
            "map", 'wanted is an object such as {"boat": "ship"}: category, class'
        ) from error


def look_at(database: Database, access: Access, site_id: int, sent: Sent) -> Looked:
    """Tell what an import would bring to a site."""
    with database.reading() as session:
        _require_site(session, access, Scope.INGEST, site_id)
        return importing.look_at(session, site_id, sent.data, sent.file)


def import_file(
    session: Session, access: Access, site_id: int, sent: Sent, choices: ImportChoices
) -> Imported:
    """Store an uploaded file's boxes."""
    _require_site(session, access, Scope.INGEST, site_id)
    imported = importing.store(session, site_id, sent.sha256, sent.file, choices, access.user_id)
    if imported.created:
        record(
            session,
            access,
            "import",
            "ground truth",
            imported.file.id,
            site_id=site_id,
            file_name=imported.file.file_name,
            images=imported.images,
            boxes=imported.boxes,
            classes=imported.file.class_of_category,
        )
    return imported


def remove_file(session: Session, access: Access, file_id: int) -> None:
    """Delete an imported file with its boxes, later ones too, for 30 days."""
    file = file_for(session, access, Scope.INGEST, file_id)
    record(
        session,
        access,
        "delete",
        "ground truth",
        file.id,
        site_id=file.site_id,
        file_name=file.file_name,
    )
    deletions.delete(
        session,
        "ground_truth_file",
        [file.id],
        site_id=file.site_id,
        label=file.file_name,
        user_id=access.user_id,
    )


def link(session: Session, access: Access, site_id: int) -> int:
    """Link a site's absent photographs with those that came."""
    _require_site(session, access, Scope.REVIEW, site_id)
    linked = service.link(session, site_id)
    if linked:
        record(session, access, "link", "ground truth", None, site_id=site_id, photographs=linked)
    return linked


def set_complete(
    session: Session, access: Access, image: GroundTruthImage, *, complete: bool
) -> None:
    """Say that every vessel of an image has its box, or take that back."""
    if image.is_complete == complete:
        return
    service.set_complete(session, image, access.user_id, complete=complete)
    record(
        session,
        access,
        "complete" if complete else "reopen",
        "ground truth image",
        image.id,
        site_id=image.site_id,
    )


def add_box(
    session: Session,
    access: Access,
    image: GroundTruthImage,
    place_px: Mapping[str, float],
    vessel_class: VesselClass,
    *,
    is_crowd: bool,
) -> GroundTruthBox:
    """Draw a box."""
    box = service.add_box(session, image, access.user_id, place_px, vessel_class, is_crowd=is_crowd)
    _record_box(session, access, "create", box, image)
    return box


def change_box(
    session: Session, access: Access, box: GroundTruthBox, changes: Mapping[str, Any]
) -> None:
    """Move a box or give it another class."""
    service.change_box(session, box, access.user_id, changes)
    _record_box(session, access, "update", box, box.image)


def delete_box(session: Session, access: Access, box: GroundTruthBox) -> None:
    """Take a box away; it can be brought back."""
    service.delete_box(session, box)
    _record_box(session, access, "delete", box, box.image)


def restore_box(session: Session, access: Access, box: GroundTruthBox) -> None:
    """Bring a deleted box back."""
    service.restore_box(session, box)
    _record_box(session, access, "restore", box, box.image)


def _record_box(
    session: Session, access: Access, action: str, box: GroundTruthBox, image: GroundTruthImage
) -> None:
    record(
        session,
        access,
        action,
        "ground truth box",
        box.id,
        site_id=image.site_id,
        vessel_class=box.vessel_class.value,
        place_px=[box.x1_px, box.y1_px, box.x2_px, box.y2_px],
    )


def file_for(session: Session, access: Access, scope: Scope, file_id: int) -> GroundTruthFile:
    """Return a file that the caller may use so. Raises NotFound, Forbidden."""
    file = service.get_file(session, file_id)
    access.require(scope, file.site_id)
    return file


def image_for(session: Session, access: Access, scope: Scope, image_id: int) -> GroundTruthImage:
    """Return a ground truth image that the caller may use so. Raises NotFound, Forbidden."""
    image = service.get_image(session, image_id)
    access.require(scope, image.site_id)
    return image


def box_for(
    session: Session, access: Access, scope: Scope, box_id: int, *, deleted: bool = False
) -> GroundTruthBox:
    """Return a box that the caller may use so. Raises NotFound, Forbidden."""
    box = service.get_box(session, box_id, deleted=deleted)
    access.require(scope, box.image.site_id)
    return box


def _require_site(session: Session, access: Access, scope: Scope, site_id: int) -> None:
    access.require(scope, sites.get_site(session, site_id).id)
