"""The SQL of batches and their files."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any, cast

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, joinedload

from app.db import find, now
from app.imports.preview import File
from app.paging import Paging, fetch_page
from app.tables.imagery import Image
from app.tables.imports import FileState, ImageImport, ImportFile, ImportStatus
from app.tables.reviews import Correction, Review
from app.tables.runs import Pose
from app.tables.sites import Camera, Viewport

AT_ONCE = 500  # values in one `IN`
_TAKEN_ANEW = (
    "captured_at",
    "captured_at_raw",
    "captured_at_source",
    "file_name",
    "viewport_id",
    "import_id",
)


def get(session: Session, import_id: int) -> ImageImport | None:
    """Return a batch with its camera."""
    return find(session, ImageImport, import_id, joinedload(ImageImport.camera))


def listed(
    session: Session,
    site_ids: frozenset[int] | None,
    camera_id: int | None,
    status: ImportStatus | None,
    paging: Paging,
) -> tuple[Sequence[ImageImport], str | None]:
    """Return a page of batches, oldest first."""
    statement = sa.select(ImageImport)
    if site_ids is not None:
        statement = statement.where(ImageImport.site_id.in_(site_ids))
    if camera_id is not None:
        wanted = sa.literal(camera_id, sa.BigInteger())
        statement = statement.where(ImageImport.camera_id == wanted)
    if status is not None:
        statement = statement.where(ImageImport.status == status)
    return fetch_page(session, statement, ImageImport.id, paging)


def of_camera(session: Session, camera_id: int, limit: int) -> Sequence[ImageImport]:
    """Return a camera's newest batches that were not discarded, newest first."""
    return session.scalars(
        sa.select(ImageImport)
        .where(ImageImport.camera_id == camera_id, ImageImport.status != ImportStatus.DISCARDED)
        .order_by(ImageImport.id.desc())
        .limit(limit)
    ).all()


def open_named(session: Session, camera_id: int, name: str) -> ImageImport | None:
    """Return a camera's newest batch of a name that still collects."""
    return session.scalar(
        sa.select(ImageImport)
        .where(
            ImageImport.camera_id == camera_id,
            ImageImport.name == name,
            ImageImport.status == ImportStatus.COLLECTING,
        )
        .order_by(ImageImport.id.desc())
        .limit(1)
    )


def files_by_key(session: Session, import_id: int, keys: Sequence[str]) -> dict[str, ImportFile]:
    """Return files of a batch by the key of their path."""
    found: dict[str, ImportFile] = {}
    for begin in range(0, len(keys), AT_ONCE):
        statement = sa.select(ImportFile).where(
            ImportFile.import_id == import_id,
            ImportFile.path_key.in_(keys[begin : begin + AT_ONCE]),
        )
        found |= {file.path_key: file for file in session.scalars(statement)}
    return found


def files(session: Session, import_id: int, ids: Iterable[int]) -> dict[int, ImportFile]:
    """Return files of a batch by their ids."""
    statement = sa.select(ImportFile).where(
        ImportFile.import_id == import_id, ImportFile.id.in_(list(ids))
    )
    return {file.id: file for file in session.scalars(statement)}


def file_page(
    session: Session, import_id: int, state: FileState | None, paging: Paging
) -> tuple[Sequence[ImportFile], str | None]:
    """Return a page of a batch's files, in the order they were announced."""
    statement = sa.select(ImportFile).where(ImportFile.import_id == import_id)
    if state is not None:
        statement = statement.where(ImportFile.state == state)
    return fetch_page(session, statement, ImportFile.id, paging)


def all_files(session: Session, import_id: int) -> Sequence[File]:
    """Return what a preview needs of all files of a batch."""
    statement = sa.select(
        ImportFile.id,
        ImportFile.path,
        ImportFile.state,
        ImportFile.reason,
        ImportFile.sha256,
        ImportFile.media_type,
        ImportFile.size_bytes,
        ImportFile.received_bytes,
        ImportFile.width_px,
        ImportFile.height_px,
        ImportFile.exif_at,
        ImportFile.listed_at,
        ImportFile.modified_at,
    ).where(ImportFile.import_id == import_id)
    return cast("Sequence[File]", session.execute(statement).all())


def staged_names(session: Session, import_id: int, limit: int) -> Sequence[str]:
    """Return paths of photographs of a batch."""
    return session.scalars(
        sa.select(ImportFile.path)
        .where(ImportFile.import_id == import_id, ImportFile.state == FileState.STAGED)
        .order_by(ImportFile.id)
        .limit(limit)
    ).all()


def add_files(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add files to a batch; one whose path is there already stays as it is."""
    if not rows:
        return
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    statement = (sqlite if is_sqlite else postgresql).insert(ImportFile)
    session.execute(
        statement.on_conflict_do_nothing(index_elements=["import_id", "path_key"]),
        [dict(row) for row in rows],
    )


def update_files(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Change files; each row has the file's id and the columns to set, the same in all rows."""
    if rows:
        session.execute(sa.update(ImportFile), [dict(row) for row in rows])


def count_files(session: Session, import_id: int) -> int:
    """Count a batch's files."""
    statement = sa.select(sa.func.count()).where(ImportFile.import_id == import_id)
    return session.scalar(statement) or 0


def states(session: Session, import_id: int) -> dict[FileState, tuple[int, int]]:
    """Return, by state, how many files there are and how many bytes of them have come."""
    statement = (
        sa.select(ImportFile.state, sa.func.count(), sa.func.sum(ImportFile.received_bytes))
        .where(ImportFile.import_id == import_id)
        .group_by(ImportFile.state)
    )
    return {row[0]: (row[1], int(row[2] or 0)) for row in session.execute(statement)}


def forget_entries(session: Session, archive: ImportFile) -> None:
    """Remove the files that came out of an archive."""
    session.execute(
        sa.delete(ImportFile).where(
            ImportFile.import_id == archive.import_id,
            ImportFile.path.startswith(f"{archive.path}/", autoescape=True),
        )
    )


def forget_files(session: Session, import_id: int) -> None:
    """Remove all files of a batch."""
    session.execute(sa.delete(ImportFile).where(ImportFile.import_id == import_id))


def contents(session: Session, import_id: int) -> set[str]:
    """Return the SHA-256 of all bytes that were stored for a batch."""
    statement = sa.select(ImportFile.sha256).where(
        ImportFile.import_id == import_id, ImportFile.sha256.is_not(None)
    )
    return {sha256 for sha256 in session.scalars(statement) if sha256}


def release_files(session: Session, import_id: int) -> None:
    """Let a batch's files no longer speak of stored bytes: from now on its images do."""
    session.execute(
        sa.update(ImportFile)
        .where(ImportFile.import_id == import_id)
        .values(sha256=None)
        .execution_options(synchronize_session=False)
    )


def hashes_of(session: Session, camera_id: int, wanted: Sequence[str]) -> set[str]:
    """Return which of some contents a camera has images of."""
    found: set[str] = set()
    for begin in range(0, len(wanted), AT_ONCE):
        statement = sa.select(Image.sha256).where(
            Image.camera_id == camera_id,
            Image.deleted_at.is_(None),
            Image.sha256.in_(wanted[begin : begin + AT_ONCE]),
        )
        found.update(session.scalars(statement))
    return found


def known_hashes(session: Session, import_id: int, camera_id: int) -> set[str]:
    """Return which contents of a batch a camera has images of."""
    statement = (
        sa.select(Image.sha256)
        .join(ImportFile, ImportFile.sha256 == Image.sha256)
        .where(
            ImportFile.import_id == import_id,
            Image.camera_id == camera_id,
            Image.deleted_at.is_(None),
        )
    )
    return set(session.scalars(statement))


def viewports(session: Session, camera_id: int) -> Sequence[Viewport]:
    """Return a camera's viewports."""
    return session.scalars(
        sa.select(Viewport).where(Viewport.camera_id == camera_id).order_by(Viewport.id)
    ).all()


def share_camera(session: Session, camera_id: int) -> None:
    """Keep a camera's viewports as they are until this transaction ends (Postgres)."""
    session.execute(sa.select(Camera.id).where(Camera.id == camera_id).with_for_update(read=True))


def upsert_images(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add images; one that was deleted comes back as it is now told, one that is there stays."""
    if not rows:
        return
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    statement = (sqlite if is_sqlite else postgresql).insert(Image)
    statement = statement.on_conflict_do_update(
        index_elements=["camera_id", "sha256"],
        set_={name: statement.excluded[name] for name in _TAKEN_ANEW}
        | {"deleted_at": None, "deletion_id": None, "changed_at": now()},
        where=Image.deleted_at.is_not(None),
    )
    session.execute(statement, [dict(row) for row in rows])


def images_of(session: Session, batch: ImageImport) -> Sequence[Image]:
    """Return a batch's images that are not deleted."""
    return session.scalars(sa.select(Image).where(*_own(batch), Image.deleted_at.is_(None))).all()


def count_images(session: Session, batch: ImageImport) -> int:
    """Count a batch's images that are not deleted."""
    statement = sa.select(sa.func.count()).select_from(Image)
    return session.scalar(statement.where(*_own(batch), Image.deleted_at.is_(None))) or 0


def hide_images(session: Session, batch: ImageImport, moment: datetime) -> int:
    """Delete a batch's images, all at one moment; returns how many."""
    return _changed(
        session,
        sa.update(Image)
        .where(*_own(batch), Image.deleted_at.is_(None))
        .values(deleted_at=moment, changed_at=moment),
    )


def show_images(session: Session, batch: ImageImport) -> int:
    """Bring back the images that went when a batch was undone; returns how many."""
    return _changed(
        session,
        sa.update(Image)
        .where(*_own(batch), Image.deleted_at == batch.undone_at)
        .values(deleted_at=None, changed_at=now()),
    )


def _changed(session: Session, statement: sa.Update) -> int:
    result = session.execute(statement.execution_options(synchronize_session=False))
    return int(getattr(result, "rowcount", 0))


def takes_along(session: Session, batch: ImageImport) -> tuple[int, int, int, int]:
    """Count what rests on a batch's images: poses, runs, reviews that stand, corrections."""
    own = (*_own(batch), Image.deleted_at.is_(None))
    poses = sa.select(Pose.id).join(Image, Image.id == Pose.image_id).where(*own)
    counted = session.execute(
        sa.select(sa.func.count(Pose.id), sa.func.count(sa.distinct(Pose.run_id)))
        .join(Image, Image.id == Pose.image_id)
        .where(*own)
    ).one()
    reviews = sa.select(sa.func.count()).where(
        Review.pose_id.in_(poses), Review.replaced_at.is_(None)
    )
    corrections = sa.select(sa.func.count()).where(
        Correction.pose_id.in_(poses), Correction.deleted_at.is_(None)
    )
    return counted[0], counted[1], session.scalar(reviews) or 0, session.scalar(corrections) or 0


def _own(batch: ImageImport) -> tuple[sa.ColumnElement[bool], sa.ColumnElement[bool]]:
    return Image.import_id == batch.id, Image.camera_id == batch.camera_id
