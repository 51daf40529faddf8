"""Rows of recordings that are looked at before they are imported."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.tables.ais import AisFile
from app.tables.ais_uploads import AisUpload, UploadState

RUNNING = (UploadState.QUEUED, UploadState.IMPORTING)


def upload(session: Session, upload_id: int) -> AisUpload | None:
    """Return an upload."""
    return find(session, AisUpload, upload_id)


def of_job(session: Session, workflow_id: str) -> AisUpload | None:
    """Return the upload that a job imports."""
    return session.scalar(sa.select(AisUpload).where(AisUpload.workflow_id == workflow_id))


def not_imported(session: Session, site_ids: frozenset[int] | None) -> Sequence[AisUpload]:
    """Return the uploads of some sites (None: of all) that are not imported yet, newest first."""
    statement = sa.select(AisUpload).where(AisUpload.state != UploadState.IMPORTED)
    if site_ids is not None:
        statement = statement.where(AisUpload.site_id.in_(site_ids))
    return session.scalars(statement.order_by(AisUpload.id.desc()).limit(50)).all()


def advance(session: Session, upload_id: int, progress: float) -> bool:
    """Note how far an import is; False when it is no longer wanted."""
    statement = (
        sa.update(AisUpload)
        .where(AisUpload.id == upload_id, AisUpload.state == UploadState.IMPORTING)
        .values(progress=progress)
    )
    return session.connection().execute(statement).rowcount == 1


def remove_older(session: Session, before: datetime) -> set[str]:
    """Remove uploads nobody waits for; return what their bytes are known by."""
    gone = (
        sa.delete(AisUpload)
        .where(AisUpload.created_at < before, AisUpload.state.not_in(RUNNING))
        .returning(AisUpload.sha256)
    )
    return set(session.scalars(gone))


def unused(session: Session, sha256s: set[str]) -> set[str]:
    """Return which bytes neither a recording nor an upload has."""
    speaking = sa.union(
        *(
            sa.select(table.sha256).where(table.sha256.in_(sha256s))
            for table in (AisFile, AisUpload)
        )
    )
    return sha256s - set(session.scalars(speaking))
