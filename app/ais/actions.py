"""Importing AIS for a caller: where they may, the import and its audit line together."""

from contextlib import ExitStack

from fastapi import UploadFile
from sqlalchemy.orm import Session

from app.ais import service
from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.errors import Invalid
from app.sites.actions import site_for
from app.storage import Storage


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
    session: Session,
    storage: Storage,
    settings: Settings,
    access: Access,
    upload: UploadFile,
    site_id: int | None,
) -> service.Imported:
    """Import an uploaded recording. The session's first statement comes after all decoding."""
    site_id = site_to_import_for(database, access, site_id)
    known = service.known_file(database, upload.file, site_id)
    if known is not None:
        return service.Imported(known, created=False)
    with ExitStack() as stack:
        recording = stack.enter_context(
            service.decoded(
                storage,
                upload.file,
                upload.filename or "",
                max_bytes=settings.max_ais_file_bytes,
            )
        )
        imported = service.store(session, recording, site_id=site_id, user_id=access.user_id)
    if imported.created:
        file = imported.file
        record(
            session, access, "import", "ais_file", file.id, file.site_id, file_name=file.file_name
        )
    return imported
