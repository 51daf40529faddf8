"""Deleting for a while, bringing back, and after 30 days removing for good.

A deletion names one thing (or several images at once) and takes along what belongs to it. Nothing
is removed: the rows are hidden from every query (see `app.tables.deletion`), so that bringing them
back is exact. The names of what is hidden are free for others; whoever restores is told when one
was taken meanwhile.
"""

from collections.abc import Collection, Sequence
from datetime import datetime, timedelta

import sqlalchemy as sa
import structlog
from sqlalchemy.orm import Session

from app.db import Database, now
from app.deletions import extents, repository
from app.errors import Conflict, NotFound
from app.imagery import service as imagery
from app.paging import Paging
from app.storage import Storage
from app.tables.ais import AisFile
from app.tables.deletion import Deletion

log = structlog.get_logger()
KEPT = timedelta(days=30)
ROWS_AT_ONCE = 200
TAKEN_NAME = "its name was given to another one meanwhile; rename that first"
TAKEN = {
    "ais_file": "the same recording was imported again meanwhile; delete that one first",
    "ground_truth_file": "the same file was imported again, or somebody drew in its photographs "
    "meanwhile; remove that first",
    "model": "the same detector was added again meanwhile; remove that one first",
    "watched_folder": "the folder is watched again meanwhile; remove that first",
    "water_levels": "another series was uploaded meanwhile; remove that one first",
}


def preview(session: Session, entity: str, ids: Collection[int]) -> dict[str, int]:
    """Count what would go along with some rows of one kind (`site`, `camera`, ...)."""
    return extents.counts(session, entity, extents.extent(entity, ids))


def delete(
    session: Session,
    entity: str,
    ids: Collection[int],
    *,
    site_id: int | None,
    label: str,
    user_id: int | None = None,
) -> Deletion:
    """Hide rows of one kind with all that belongs to them, as one deletion.

    Raises Conflict while a worker is at a run among them.
    """
    going = extents.extent(entity, ids)
    busy = repository.under_way(session, going)
    if busy:
        runs = ", ".join(map(str, busy[:5]))
        raise Conflict(f"a worker is at run {runs}; cancel it, or wait until it has ended")
    deletion = Deletion(
        entity=entity,
        entity_id=next(iter(ids)) if len(ids) == 1 else None,
        site_id=site_id,
        label=label[:300],
        counts=extents.counts(session, entity, going),
        deleted_by_id=user_id,
        deleted_at=now(),
    )
    session.add(deletion)
    session.flush()
    cameras = repository.cameras_of(session, going)
    repository.hide(session, going, deletion)
    if entity == "viewport":
        for camera_id in cameras:
            imagery.assign_viewports(session, camera_id)
    return deletion


def get_deletion(session: Session, deletion_id: int) -> Deletion:
    """Return a deletion that can still be undone. Raises NotFound."""
    deletion = repository.get(session, deletion_id)
    if deletion is None:
        raise NotFound("there is no such deletion; it was undone, or its time is over")
    return deletion


def deletion_of(session: Session, entity: str, entity_id: int) -> Deletion | None:
    """Return the deletion that took one thing, if it can still be undone."""
    return repository.of(session, entity, entity_id)


def list_deletions(
    session: Session, site_ids: frozenset[int] | None, paging: Paging
) -> tuple[Sequence[Deletion], str | None]:
    """Return a page of what was deleted on some sites (None: all) and can be brought back."""
    return repository.listed(session, site_ids, paging)


def newest_deletions(
    session: Session, site_ids: frozenset[int] | None, limit: int = 200
) -> Sequence[Deletion]:
    """Return what was deleted last on some sites (None: all)."""
    return repository.newest(session, site_ids, limit)


def gone_at(deletion: Deletion) -> datetime:
    """Return when a deletion can no longer be undone."""
    return deletion.deleted_at + KEPT


def restore(session: Session, deletion: Deletion) -> None:
    """Bring back what a deletion took.

    Raises Conflict where something above it is deleted too, where a name was taken meanwhile, or
    where another viewport stands in the time of one that would come back.
    """
    above = repository.hidden_parents(session, deletion)
    if above:
        raise Conflict(f"{above[0]!r}, which it belongs to, is deleted too; restore that first")
    if repository.is_replaced(session, deletion):
        raise Conflict(TAKEN[deletion.entity])
    if deletion.entity == "feed" and deletion.entity_id is not None:
        from app.feeds import service as feeds  # noqa: PLC0415  batches of images load no AIS

        feeds.restore_feed(session, deletion.entity_id)
    cameras = repository.viewport_cameras(session, deletion)
    try:
        with session.begin_nested():
            repository.show(session, deletion)
    except sa.exc.IntegrityError as error:
        raise Conflict(TAKEN.get(deletion.entity, TAKEN_NAME)) from error
    for camera_id in cameras:
        if repository.has_overlaps(session, camera_id):
            raise Conflict(
                "another viewport is valid at its time now; change that one's times first"
            )
        imagery.assign_viewports(session, camera_id)


def purge(database: Database, storage: Storage, before: datetime | None = None) -> dict[str, int]:
    """Remove for good what was deleted before a moment (30 days ago); returns how much of each.

    In small transactions, so that nobody waits. Bytes that nothing speaks of any more go last.
    """
    before = before or now() - KEPT
    removed: dict[str, int] = {}
    for table in extents.CHILDREN_FIRST:
        while True:
            with database.writing() as session:
                ids = repository.expired(session, table, before, ROWS_AT_ONCE)
                sha256s = repository.contents(session, table, ids)
                if table is not AisFile:
                    repository.remove(session, table, ids)
            if not ids:
                break
            if table is AisFile:
                from app.ais import service as ais  # noqa: PLC0415  see restore

                ais.remove_files(database, ids)
            name = table.__tablename__
            removed[name] = removed.get(name, 0) + len(ids)
            removed["files"] = removed.get("files", 0) + sweep(database, storage, sha256s)
    with database.writing() as session:
        repository.forget(session, before)
    return {name: count for name, count in removed.items() if count}


def sweep(database: Database, storage: Storage, sha256s: Collection[str]) -> int:
    """Remove stored bytes that no row speaks of, and what was derived; returns how many."""
    if not sha256s:
        return 0
    with database.reading() as session:
        unused = repository.unreferenced(session, sha256s)
    for sha256 in unused:
        storage.remove(sha256)
        imagery.forget_previews(storage, sha256)
    return len(unused)
