"""Importing AIS for a caller: where they may, the import and its audit line together."""

import json

from fastapi import UploadFile
from sqlalchemy.orm import Session

from app.ais import service, uploads
from app.ais.importing import Importer
from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.deletions import actions as deletions
from app.domain.table_mapping import MappingError, TableMapping
from app.errors import Invalid
from app.sites.actions import site_for
from app.storage import Storage
from app.tables.ais import AisFile
from app.tables.ais_uploads import AisUpload

LONGEST_WAIT_S = 60.0  # while the same bytes are stored for somebody; a caller may try again


def site_to_import_for(database: Database, access: Access, site_id: int | None) -> int | None:
    """Return the site an import is for; None stands for all sites.

    Without a word about it, an import is shared by all sites if the caller may ingest on all of
    them, or goes to the one site where they may. Raises NotFound, Forbidden or Invalid.
    """
    if site_id is not None:
        with database.reading() as session:
            return site_for(session, access, Scope.INGEST, site_id).id
    own = access.site_ids(Scope.INGEST)
    if own is None:
        return None
    if len(own) == 1:
        return next(iter(own))
    raise Invalid.field("site_id", "say which of your sites this recording is for")


def import_upload(
    database: Database,
    storage: Storage,
    settings: Settings,
    access: Access,
    upload: UploadFile,
    site_id: int | None,
    mapping: TableMapping | None = None,
) -> service.Imported:
    """Import an uploaded recording."""
    site_id = site_to_import_for(database, access, site_id)
    source = service.Source(
        upload.file, upload.filename or "", settings.max_ais_file_bytes, mapping
    )
    return service.import_recording(database, storage, source, importer_for(access, site_id))


def stage_upload(
    database: Database,
    storage: Storage,
    settings: Settings,
    access: Access,
    upload: UploadFile,
    site_id: int | None,
) -> AisUpload | service.Imported:
    """Keep an uploaded recording to be looked at, or return it as it was imported before."""
    return uploads.stage(
        database,
        storage,
        settings,
        upload.file,
        file_name=upload.filename or "",
        site_id=site_to_import_for(database, access, site_id),
        user_id=access.user_id,
    )


def importer_for(access: Access, site_id: int | None) -> Importer:
    """Return who imports for a site, with the audit line to be written beside the file."""

    def note(session: Session, file: AisFile) -> None:
        record(
            session, access, "import", "ais_file", file.id, file.site_id, file_name=file.file_name
        )

    return Importer(site_id, access.user_id, note, wait_s=LONGEST_WAIT_S)


def file_for(session: Session, access: Access, scope: Scope, file_id: int) -> AisFile:
    """Return a recording that the caller may read, and do what the scope allows with.

    Raises NotFound, Forbidden. A recording of all sites needs the scope on all of them.
    """
    file = service.get_file(session, access.site_ids(Scope.READ), file_id)
    if scope is not Scope.READ:
        access.require(scope, file.site_id)
    return file


def delete_file(session: Session, access: Access, file: AisFile) -> None:
    """Delete a recording with its reports, for 30 days."""
    deletions.delete(session, access, "ais_file", file.id, file.site_id, label(file))


def label(file: AisFile) -> str:
    """Return what a recording is called among what was deleted: its name may tell a vessel."""
    day = f" of {file.first_at:%Y-%m-%d}" if file.first_at else ""
    return f"Recording {file.id}{day}"


def upload_for(session: Session, access: Access, upload_id: int) -> AisUpload:
    """Return an upload for a site where the caller may ingest."""
    upload = uploads.get(session, upload_id)
    access.require(Scope.INGEST, upload.site_id)
    return upload


def mapping_of(text: str) -> TableMapping | None:
    """Read a mapping sent as JSON; empty: none. Raises Invalid naming its field."""
    if not text.strip():
        return None
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Invalid.field("mapping", "must be a JSON object") from error
    if not isinstance(data, dict):
        raise Invalid.field("mapping", "must be a JSON object")
    try:
        return TableMapping.of(data)
    except MappingError as error:
        raise Invalid.field(f"mapping.{error.field}", str(error)) from error
