"""The SQL of deleting: hiding what goes, showing it again, removing it for good."""

from collections.abc import Collection, Iterable, Sequence
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from app.db import Base, find, now
from app.deletions.extents import ALONE, CHILDREN_FIRST, Extent
from app.paging import Paging, fetch_page
from app.tables.ais import AisFile
from app.tables.deletion import WITH_DELETED, Deletable, Deletion, parents_of
from app.tables.detection import DetectionSet, Model
from app.tables.imagery import Image
from app.tables.imports import ImageImport, ImportStatus
from app.tables.live import StandingRun
from app.tables.registration import Keypoint, Landmark
from app.tables.runs import RemovedPose, Run, RunStatus
from app.tables.sites import Camera, Site, Viewport
from app.tables.water import WaterLevel


def under_way(session: Session, going: Extent) -> Sequence[int]:
    """Return the ids of the runs among what goes that a worker may be at."""
    return session.scalars(
        sa.select(Run.id).where(
            Run.id.in_(going.of(Run)),
            Run.status.in_((RunStatus.QUEUED, RunStatus.RUNNING)),
            Run.id.not_in(sa.select(StandingRun.run_id).where(StandingRun.run_id.is_not(None))),
        )
    ).all()


def hide(session: Session, going: Extent, deletion: Deletion) -> None:
    """Hide all that goes, except what an earlier deletion took."""
    for table, ids in going.rows.items():
        session.execute(
            sa.update(table)
            .where(table.id.in_(ids), table.deleted_at.is_(None))
            .values(
                deleted_at=deletion.deleted_at,
                deletion_id=deletion.id,
                **_changed(table, deletion.deleted_at),
            )
            .execution_options(synchronize_session=False)
        )
    session.expire_all()


def _changed(table: type[Any], moment: datetime) -> dict[str, datetime]:
    """Return the column that tells exports of the change, where a table has it."""
    return {"changed_at": moment} if table in {Image, Run} else {}


def show(session: Session, deletion: Deletion) -> None:
    """Show again what one deletion took. Raises IntegrityError where a name is taken meanwhile."""
    for table in CHILDREN_FIRST:
        session.execute(
            sa.update(table)
            .where(table.deletion_id == deletion.id)
            .values(deleted_at=None, deletion_id=None, **_changed(table, now()))
            .execution_options(synchronize_session=False)
        )
    if deletion.entity == "import":
        # Fewer than it had, where the same photographs were imported anew meanwhile.
        own = sa.select(sa.func.count(Image.id)).where(
            Image.import_id == ImageImport.id,
            Image.camera_id == ImageImport.camera_id,
            Image.deleted_at.is_(None),
        )
        session.execute(
            sa.update(ImageImport)
            .where(ImageImport.id == deletion.entity_id)
            .values(
                status=ImportStatus.COMMITTED,
                undone_at=None,
                image_count=own.scalar_subquery(),
                version=ImageImport.version + 1,
            )
            .execution_options(synchronize_session=False)
        )
    session.expire_all()
    session.delete(deletion)
    session.flush()


def get(session: Session, deletion_id: int) -> Deletion | None:
    """Return a deletion."""
    return find(session, Deletion, deletion_id)


def of(session: Session, entity: str, entity_id: int) -> Deletion | None:
    """Return the deletion of one thing that can still be undone."""
    return session.scalar(
        sa.select(Deletion).where(Deletion.entity == entity, Deletion.entity_id == entity_id)
    )


def listed(
    session: Session, site_ids: Iterable[int] | None, paging: Paging
) -> tuple[Sequence[Deletion], str | None]:
    """Return a page of the deletions on some sites (None: all), oldest first."""
    return fetch_page(session, _on_sites(site_ids), Deletion.id, paging)


def newest(session: Session, site_ids: Iterable[int] | None, limit: int) -> Sequence[Deletion]:
    """Return the newest deletions on some sites (None: all)."""
    statement = _on_sites(site_ids).order_by(Deletion.id.desc()).limit(limit)
    return session.scalars(statement).all()


def _on_sites(site_ids: Iterable[int] | None) -> sa.Select[Deletion]:
    statement = sa.select(Deletion)
    return statement if site_ids is None else statement.where(Deletion.site_id.in_(site_ids))


def hidden_parents(session: Session, deletion: Deletion) -> Sequence[str]:
    """Return the names of what must be restored before this: deleted rows above its own."""
    above: list[sa.Select[str]] = []
    for table, parents in (
        (Camera, (Site,)),
        (Viewport, (Camera,)),
        (Run, (Viewport,)),
        (Image, (Camera,)),
        (AisFile, (Site,)),
    ):
        for parent in parents:
            key = getattr(table, f"{parent.__tablename__[:-1]}_id")
            above.append(
                sa.select(parent.name)
                .where(
                    parent.id.in_(sa.select(key).where(table.deletion_id == deletion.id)),
                    parent.deleted_at.is_not(None),
                    parent.deletion_id.is_distinct_from(deletion.id),
                )
                .distinct()
            )
    above += _hidden_above_small(deletion) + _hidden_supports(deletion)
    return session.scalars(sa.union(*above), execution_options=WITH_DELETED).all()


def _hidden_above_small(deletion: Deletion) -> list[sa.Select[str]]:
    """Return what selects the names of deleted things that a smaller one belongs to."""
    return [
        sa.select(parent.c["name" if "name" in parent.c else "file_name"]).where(
            parent.c.id.in_(sa.select(getattr(table, key)).where(table.deletion_id == deletion.id)),
            parent.c.deleted_at.is_not(None),
            parent.c.deletion_id.is_distinct_from(deletion.id),
        )
        for table in ALONE
        for key, parent in parents_of(sa.inspect(table))
    ]


def _hidden_supports(deletion: Deletion) -> list[sa.Select[str]]:
    """Return what selects the names of deleted models and landmarks that the rows rest on."""
    seen = (
        sa.select(Keypoint.landmark_id)
        .join(Viewport, Viewport.id == Keypoint.viewport_id)
        .where(Viewport.deletion_id == deletion.id)
    )
    by_runs = (
        sa.select(table.model_id).where(table.deletion_id == deletion.id)
        for table in (Run, StandingRun)
    )
    return [
        sa.select(Landmark.name).where(Landmark.id.in_(seen), Landmark.deleted_at.is_not(None)),
        *(
            sa.select(Model.name).where(Model.id.in_(used), Model.deleted_at.is_not(None))
            for used in by_runs
        ),
    ]


def is_replaced(session: Session, deletion: Deletion) -> bool:
    """Whether what would come back has its place taken by something no index would refuse.

    A site's other series of water levels, or the same detector under another name.
    """
    if deletion.entity == "water_levels":
        present = sa.exists().where(
            WaterLevel.site_id == deletion.entity_id, WaterLevel.deleted_at.is_(None)
        )
    elif deletion.entity == "model":
        gone = sa.select(Model.sha256).where(Model.deletion_id == deletion.id)
        present = sa.exists().where(Model.sha256.in_(gone), Model.deleted_at.is_(None))
    else:
        return False
    return bool(session.scalar(sa.select(present), execution_options=WITH_DELETED))


def cameras_of(session: Session, going: Extent) -> Sequence[int]:
    """Return the cameras whose viewports go."""
    return session.scalars(
        sa.select(Viewport.camera_id).where(Viewport.id.in_(going.of(Viewport))).distinct()
    ).all()


def has_overlaps(session: Session, camera_id: int) -> bool:
    """Whether two viewports of a camera are valid at the same time."""
    one, other = aliased(Viewport), aliased(Viewport)
    pair = (
        sa.select(one.id)
        .join(other, sa.and_(other.camera_id == one.camera_id, other.id > one.id))
        .where(
            one.camera_id == camera_id,
            _begins_before_end(other, one),
            _begins_before_end(one, other),
        )
    )
    return session.scalar(pair.limit(1)) is not None


def _begins_before_end(begins: type[Viewport], ends: type[Viewport]) -> sa.ColumnElement[bool]:
    return sa.or_(
        begins.valid_from.is_(None),
        ends.valid_until.is_(None),
        begins.valid_from < ends.valid_until,
    )


def viewport_cameras(session: Session, deletion: Deletion) -> Sequence[int]:
    """Return the cameras whose viewports one deletion took."""
    return session.scalars(
        sa.select(Viewport.camera_id).where(Viewport.deletion_id == deletion.id).distinct(),
        execution_options=WITH_DELETED,
    ).all()


def expired(session: Session, table: type[Deletable], before: datetime, limit: int) -> list[int]:
    """Return the ids of rows of a table that were deleted before a moment."""
    columns: Any = table
    statement = sa.select(columns.id).where(columns.deleted_at < before)
    if columns is Model:  # one that a run came back to is kept
        used = sa.union(*(sa.select(rows.model_id) for rows in (Run, StandingRun)))
        statement = statement.where(Model.id.not_in(used))
    return list(session.scalars(statement.limit(limit), execution_options=WITH_DELETED))


def contents(session: Session, table: type[Deletable], ids: Collection[int]) -> set[str]:
    """Return the addresses of the bytes of images, recordings or models, deleted or not."""
    columns: Any = table
    if columns not in {Image, AisFile, Model}:
        return set()
    return set(
        session.scalars(
            sa.select(columns.sha256).where(columns.id.in_(ids)), execution_options=WITH_DELETED
        )
    )


def remove(session: Session, table: type[Any], ids: Collection[int]) -> None:
    """Remove rows for good, with all that belongs to them; with a model what it found."""
    if table is Model:
        other, gone = aliased(Model), sa.select(Model.sha256).where(Model.id.in_(ids))
        kept = sa.select(other.sha256).where(other.id.not_in(ids))
        session.execute(
            sa.delete(DetectionSet)
            .where(DetectionSet.model_sha256.in_(gone), DetectionSet.model_sha256.not_in(kept))
            .execution_options(synchronize_session=False)
        )
    session.execute(
        sa.delete(table).where(table.id.in_(ids)).execution_options(synchronize_session=False)
    )


def forget(session: Session, before: datetime) -> None:
    """Remove the records of deletions whose rows were removed, and of poses taken back."""
    session.execute(sa.delete(Deletion).where(Deletion.deleted_at < before))
    session.execute(sa.delete(RemovedPose).where(RemovedPose.removed_at < before))


def unreferenced(session: Session, sha256s: Collection[str]) -> set[str]:
    """Return those addresses of stored bytes that no row of any table speaks of."""
    # Tables, not classes: what is deleted for a while still needs its bytes.
    speaking = [
        sa.select(table.c.sha256).where(table.c.sha256.in_(sha256s))
        for table in Base.metadata.sorted_tables
        if "sha256" in table.c
    ]
    return set(sha256s) - set(session.scalars(sa.union(*speaking)))
