"""The SQL of deleting: what goes with what, hiding it, showing it again, removing it for good."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from app.db import Base, find, now
from app.paging import Paging, fetch_page
from app.tables.ais import AisFile, AisPosition, AisStatic
from app.tables.deletion import WITH_DELETED, Deletable, Deletion
from app.tables.imagery import Image
from app.tables.imports import ImageImport, ImportStatus
from app.tables.live import StandingRun
from app.tables.registration import Registration
from app.tables.reviews import Correction, Review
from app.tables.runs import Pose, Run, RunStatus
from app.tables.sites import Camera, Site, Viewport

DELETABLE: Mapping[str, type[Any]] = {
    "site": Site,
    "camera": Camera,
    "viewport": Viewport,
    "run": Run,
    "import": ImageImport,
    "image": Image,
    "ais_file": AisFile,
}
# Runs rest on registrations and images on viewports, so they are removed in this order.
CHILDREN_FIRST = (AisFile, Run, Image, Viewport, Camera, Site)
Ids = sa.Select[int]


@dataclass(frozen=True, slots=True)
class Extent:
    """The ids of all that one deletion takes, by table; a table that is not named loses nothing."""

    rows: Mapping[type[Any], Ids]

    def of(self, table: type[Any]) -> Ids:
        """Return the ids a table loses."""
        return self.rows.get(table, sa.select(table.id).where(sa.false()))


def extent(entity: str, ids: Collection[int]) -> Extent:
    """Return what goes with some rows of one kind."""
    table = DELETABLE[entity]
    if table is ImageImport:  # the batch itself stays, and can be brought back there too
        return Extent({Image: _images_of(ids)})
    rows: dict[type[Any], Ids] = {table: sa.select(table.id).where(table.id.in_(ids))}
    if Site in rows:
        rows[Camera] = sa.select(Camera.id).where(Camera.site_id.in_(rows[Site]))
        rows[AisFile] = sa.select(AisFile.id).where(AisFile.site_id.in_(rows[Site]))
    if Camera in rows:
        rows[Viewport] = sa.select(Viewport.id).where(Viewport.camera_id.in_(rows[Camera]))
        rows[Image] = sa.select(Image.id).where(Image.camera_id.in_(rows[Camera]))
    if Viewport in rows:
        rows[Run] = sa.select(Run.id).where(Run.viewport_id.in_(rows[Viewport]))
    return Extent(rows)


def _images_of(import_ids: Collection[int]) -> Ids:
    return (
        sa.select(Image.id)
        .join(ImageImport, ImageImport.id == Image.import_id)
        .where(ImageImport.id.in_(import_ids), Image.camera_id == ImageImport.camera_id)
    )


def counts(session: Session, entity: str, going: Extent) -> dict[str, int]:
    """Count what goes along, in words for people; kinds without any are left out."""
    poses = sa.or_(Pose.run_id.in_(going.of(Run)), Pose.image_id.in_(going.of(Image)))
    statements = {
        "cameras": _count(Camera, Camera.id.in_(going.of(Camera))),
        "viewports": _count(Viewport, Viewport.id.in_(going.of(Viewport))),
        "registrations": _count(Registration, Registration.viewport_id.in_(going.of(Viewport))),
        "images": _count(Image, Image.id.in_(going.of(Image))),
        "runs": _count(Run, Run.id.in_(going.of(Run))),
        "poses": _count(Pose, poses),
        "reviews": _count(Review, Review.pose_id == Pose.id, poses),
        "corrections": _count(Correction, Correction.pose_id == Pose.id, poses),
        "AIS recordings": _count(AisFile, AisFile.id.in_(going.of(AisFile))),
    }
    if entity == "ais_file":  # of a whole site there may be many millions
        statements = {
            "positions": _count(AisPosition, AisPosition.file_id.in_(going.of(AisFile))),
            "static reports": _count(AisStatic, AisStatic.file_id.in_(going.of(AisFile))),
        }
    own = DELETABLE[entity].__tablename__
    found = {name: session.scalar(statement) or 0 for name, statement in statements.items()}
    return {name: count for name, count in found.items() if count and name != own}


def _count(table: type[Any], *conditions: sa.ColumnElement[bool]) -> sa.Select[int]:
    return sa.select(sa.func.count(table.id)).where(*conditions)


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
        session.execute(
            sa.update(ImageImport)
            .where(ImageImport.id == deletion.entity_id)
            .values(status=ImportStatus.COMMITTED, undone_at=None, version=ImageImport.version + 1)
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
    return session.scalars(sa.union(*above), execution_options=WITH_DELETED).all()


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
    return list(
        session.scalars(
            sa.select(columns.id).where(columns.deleted_at < before).limit(limit),
            execution_options=WITH_DELETED,
        )
    )


def contents(session: Session, table: type[Deletable], ids: Collection[int]) -> set[str]:
    """Return the addresses of the bytes of images or recordings, deleted or not."""
    columns: Any = table
    if columns not in {Image, AisFile}:
        return set()
    return set(
        session.scalars(
            sa.select(columns.sha256).where(columns.id.in_(ids)), execution_options=WITH_DELETED
        )
    )


def remove(session: Session, table: type[Any], ids: Collection[int]) -> None:
    """Remove rows for good, with all that belongs to them."""
    session.execute(
        sa.delete(table).where(table.id.in_(ids)).execution_options(synchronize_session=False)
    )


def forget(session: Session, before: datetime) -> None:
    """Remove the records of deletions whose rows were removed."""
    session.execute(sa.delete(Deletion).where(Deletion.deleted_at < before))


def unreferenced(session: Session, sha256s: Collection[str]) -> set[str]:
    """Return those addresses of stored bytes that no row of any table speaks of."""
    # Tables, not classes: what is deleted for a while still needs its bytes.
    speaking = [
        sa.select(table.c.sha256).where(table.c.sha256.in_(sha256s))
        for table in Base.metadata.sorted_tables
        if "sha256" in table.c
    ]
    return set(sha256s) - set(session.scalars(sa.union(*speaking)))
