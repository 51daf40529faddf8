"""What callers do with detectors: the permission, the change and the audit line together.

A model runs native code in the workers of all sites, so adding one takes the scope `ingest` on all
sites. Imported detections are data: they take it on the sites of their images.
"""

import json
from collections.abc import Mapping

from fastapi import UploadFile
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.deletions import service as deletions
from app.detectors import imported, service
from app.errors import Forbidden, Invalid, TooLarge
from app.jobs import JobClient
from app.storage import Storage


def add_upload(
    session: Session,
    storage: Storage,
    jobs: JobClient,
    settings: Settings,
    access: Access,
    upload: UploadFile,
    name: str,
    family: str,
) -> service.AddedModel:
    """Add an uploaded model; looked at and stored before the session's first statement."""
    access.require(Scope.INGEST, None)
    name, family = service.checked_name(name), service.checked_family(family)
    file = service.store_file(storage, upload.file, max_bytes=settings.max_model_bytes)
    added = service.add_model(session, jobs, file, name=name, family=family, user_id=access.user_id)
    if added.created:
        record(session, access, "create", "model", added.model.id, name=name, sha256=file.sha256)
    return added


def delete_model(session: Session, access: Access, model_id: int) -> None:
    """Delete a model that no run uses, for 30 days."""
    access.require(Scope.INGEST, None)
    model = service.get_model(session, model_id)
    service.require_unused(session, model)
    deletions.delete(
        session, "model", [model_id], site_id=None, label=model.name, user_id=access.user_id
    )
    record(session, access, "delete", "model", model_id, name=model.name, sha256=model.sha256)


def import_detections(
    database: Database,
    session: Session,
    settings: Settings,
    access: Access,
    upload: UploadFile,
    images: UploadFile | None,
    *,
    name: str,
    camera_id: int | None,
    categories: str,
) -> imported.ImportedDetections:
    """Import an uploaded results file; read and matched before the session's first statement."""
    data = _all_of(upload, settings)
    with database.reading() as reading:
        found = imported.resolve(
            reading,
            data,
            name=name or (upload.filename or "detections").rpartition("/")[2],
            camera_id=camera_id,
            images=None if images is None else _all_of(images, settings),
            categories=_categories(categories),
            site_ids=access.site_ids(Scope.READ),
        )
    for site_id in found.site_ids:
        access.require(Scope.INGEST, site_id)
    if not found.site_ids and not access.may(Scope.INGEST, None):
        raise Forbidden("a file without images takes the scope `ingest` on all sites")
    outcome = imported.store(session, found, user_id=access.user_id)
    if outcome.created:
        record(
            session,
            access,
            "import",
            "detections",
            outcome.model.id,
            images=outcome.images,
            detections=outcome.detections,
        )
    return outcome


def _all_of(upload: UploadFile, settings: Settings) -> bytes:
    data = upload.file.read(settings.max_upload_bytes + 1)
    if len(data) > settings.max_upload_bytes:
        raise TooLarge(f"at most {settings.max_upload_bytes} bytes are taken here")
    return data


def _categories(text: str) -> Mapping[int, int] | None:
    """Read `{"9": 8}`: the file's category ids and the class ids they stand for."""
    if not text.strip():
        return None
    try:
        return {int(category): int(class_id) for category, class_id in json.loads(text).items()}
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise Invalid.field(
            "categories", 'wanted is an object such as {"9": 8}: category id, class id'
        ) from error
