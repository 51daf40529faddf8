"""The SQL of watched folders and standing runs."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.live.known_file import KnownFile
from app.paging import Paging, fetch_page
from app.tables.ais import AisPosition
from app.tables.live import StandingRun, WatchedFile, WatchedFileStatus, WatchedFolder
from app.tables.sites import Camera, Viewport


def folder(session: Session, folder_id: int) -> WatchedFolder | None:
    """Return a watched folder with its camera."""
    return find(session, WatchedFolder, folder_id, joinedload(WatchedFolder.camera))


def folders(session: Session, camera_id: int) -> Sequence[WatchedFolder]:
    """Return a camera's watched folders."""
    return session.scalars(
        sa.select(WatchedFolder)
        .where(WatchedFolder.camera_id == camera_id)
        .order_by(WatchedFolder.id)
    ).all()


def watched(session: Session) -> Mapping[int, int]:
    """Return the folders to watch, each with its version."""
    rows = session.execute(
        sa.select(WatchedFolder.id, WatchedFolder.version).where(WatchedFolder.paused_at.is_(None))
    )
    return {row[0]: row[1] for row in rows}


def folder_noted(session: Session, folder_id: int, at: datetime, trouble: str | None) -> None:
    """Say when a folder was looked at, without making it a new version."""
    session.execute(
        sa.update(WatchedFolder)
        .where(WatchedFolder.id == folder_id)
        .values(looked_at=at, trouble=trouble)
        .execution_options(synchronize_session=False)
    )


def files(session: Session, folder_id: int) -> Mapping[str, KnownFile]:
    """Return what is known of a folder's files, by path: there may be years of them."""
    rows = session.execute(
        sa.select(
            WatchedFile.path, WatchedFile.size_bytes, WatchedFile.modified_ns, WatchedFile.status
        ).where(WatchedFile.folder_id == folder_id)
    )
    return {row[0]: KnownFile(*row[1:]) for row in rows}


def remember(session: Session, folder_id: int, seen: Mapping[str, KnownFile], at: datetime) -> None:
    """Keep what became of some files, by path, in the place of what was known of them."""
    if not seen:
        return
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    statement = (sqlite if is_sqlite else postgresql).insert(WatchedFile)
    told = ("size_bytes", "modified_ns", "status", "reason", "seen_at")
    session.execute(
        statement.on_conflict_do_update(
            index_elements=["folder_id", "path"],
            set_={name: statement.excluded[name] for name in told},
        ),
        [
            {"folder_id": folder_id, "path": path, "seen_at": at, **file._asdict()}
            for path, file in seen.items()
        ],
    )


def file_counts(session: Session, folder_id: int) -> Mapping[str, int]:
    """Count a folder's files by what became of them."""
    rows = session.execute(
        sa.select(WatchedFile.status, sa.func.count())
        .where(WatchedFile.folder_id == folder_id)
        .group_by(WatchedFile.status)
    )
    return {row[0].value: row[1] for row in rows}


def refused(session: Session, folder_id: int, limit: int) -> Sequence[WatchedFile]:
    """Return the newest files of a folder that were refused."""
    return session.scalars(
        sa.select(WatchedFile)
        .where(WatchedFile.folder_id == folder_id, WatchedFile.status == WatchedFileStatus.REFUSED)
        .order_by(WatchedFile.id.desc())
        .limit(limit)
    ).all()


def standing(session: Session, standing_id: int) -> StandingRun | None:
    """Return a standing run."""
    return find(session, StandingRun, standing_id)


def standing_runs(
    session: Session, site_ids: Iterable[int] | None, paging: Paging, camera_id: int | None = None
) -> tuple[Sequence[StandingRun], str | None]:
    """Return a page of the standing runs of some sites (None: all)."""
    statement = (
        sa.select(StandingRun)
        .join(Viewport, Viewport.id == StandingRun.viewport_id)
        .join(Camera, Camera.id == Viewport.camera_id)
    )
    if site_ids is not None:
        statement = statement.where(Camera.site_id.in_(site_ids))
    if camera_id is not None:
        statement = statement.where(Camera.id == camera_id)
    return fetch_page(session, statement, StandingRun.id, paging)


def running(session: Session) -> Mapping[int, int]:
    """Return the standing runs to look after, each with its version."""
    rows = session.execute(
        sa.select(StandingRun.id, StandingRun.version).where(StandingRun.paused_at.is_(None))
    )
    return {row[0]: row[1] for row in rows}


def noted(session: Session, standing_id: int, at: datetime, trouble: str | None) -> None:
    """Say when a standing run was looked after, without making it a new version."""
    session.execute(
        sa.update(StandingRun)
        .where(StandingRun.id == standing_id)
        .values(looked_at=at, trouble=trouble)
        .execution_options(synchronize_session=False)
    )


def seen_to(session: Session, standing_id: int, report_id: int) -> None:
    """Say up to which report a standing run was fused, without making it a new version."""
    session.execute(
        sa.update(StandingRun)
        .where(StandingRun.id == standing_id)
        .values(last_report_id=report_id)
        .execution_options(synchronize_session=False)
    )


def new_reports(
    session: Session, site_id: int, after_id: int
) -> tuple[int, datetime | None, datetime | None]:
    """Return the newest report of a site after another, and the first and last fix between.

    What came from a receiver whose clock is suspect changes no image.
    """
    usable = sa.case((AisPosition.clock_suspect.is_not(sa.true()), AisPosition.fix_time))
    row = session.execute(
        sa.select(
            sa.func.max(AisPosition.id),
            sa.func.min(usable),
            sa.func.max(usable),
        ).where(
            AisPosition.id > after_id,
            sa.or_(AisPosition.site_id == site_id, AisPosition.site_id.is_(None)),
        )
    ).one()
    return row[0] or after_id, row[1], row[2]
