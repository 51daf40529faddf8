"""SQL of exports: the requests, and what is looked up beside the poses they select."""

from collections.abc import Iterator, Sequence
from datetime import datetime

import numpy as np
import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.exports.id_lists import among
from app.exports.selection_repository import Chosen
from app.paging import Paging, fetch_page
from app.tables.deletion import WITH_DELETED
from app.tables.exports import Export, ExportStatus
from app.tables.imagery import Image
from app.tables.runs import Pose, Run
from app.tables.sites import Camera, Viewport

IDS_AT_ONCE = 5000
UNDER_WAY = (ExportStatus.QUEUED, ExportStatus.RUNNING)


def get(session: Session, export_id: int) -> Export | None:
    """Return an export."""
    return find(session, Export, export_id)


def listed(
    session: Session, user_id: int | None, paging: Paging
) -> tuple[Sequence[Export], str | None]:
    """Return a page of a person's exports (None: everybody's)."""
    statement = sa.select(Export)
    if user_id is not None:
        statement = statement.where(Export.created_by_id == user_id)
    return fetch_page(session, statement, Export.id, paging)


def newest(session: Session, user_id: int | None, limit: int) -> Sequence[Export]:
    """Return the newest exports of a person (None: of everybody)."""
    statement = sa.select(Export).order_by(Export.id.desc()).limit(limit)
    if user_id is not None:
        statement = statement.where(Export.created_by_id == user_id)
    return session.scalars(statement).all()


def hold_still(session: Session) -> None:
    """Let all reads of a new session see one moment, whatever a run writes meanwhile.

    On SQLite every reading transaction does. Postgres is told besides that rows by their keys are
    near: as it comes it believes in a disk with a needle, and reads whole tables for every batch.
    Nor is it to start helpers or to compile queries for a batch: two processes are at work already.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.connection(execution_options={"isolation_level": "REPEATABLE READ"})
        session.execute(sa.text("SET LOCAL random_page_cost = 1.1"))
        session.execute(sa.text("SET LOCAL max_parallel_workers_per_gather = 0"))
        session.execute(sa.text("SET LOCAL jit = off"))


def runs(session: Session, run_ids: Sequence[int]) -> Sequence[Run]:
    """Return runs with detectors, registrations and places, by id."""
    return session.scalars(
        sa.select(Run)
        .options(
            joinedload(Run.model),
            joinedload(Run.registration),
            joinedload(Run.viewport).joinedload(Viewport.camera).joinedload(Camera.site),
        )
        .where(Run.id.in_(run_ids))
        .order_by(Run.id),
        execution_options=WITH_DELETED,
    ).all()


def capture_times(session: Session, image_ids: Sequence[int]) -> Iterator[tuple[int, datetime]]:
    """Give (id, moment) of photographs."""
    images = Image.__table__.c
    for start in range(0, len(image_ids), IDS_AT_ONCE):
        some = image_ids[start : start + IDS_AT_ONCE]
        rows = session.execute(
            sa.select(images.id, images.captured_at).where(among(images.id, some))
        )
        for row in rows:
            yield row[0], row[1]


def afloat(
    session: Session, chosen: Chosen
) -> Iterator[tuple[int, tuple[int, float, float, float, float, float]]]:
    """Give (photograph, (MMSI, place and size)) of the chosen poses, photograph by photograph."""
    poses = Pose.__table__.c
    order = np.argsort(chosen.image_ids, kind="stable")
    for start in range(0, len(order), IDS_AT_ONCE):
        some = np.sort(chosen.pose_ids[order[start : start + IDS_AT_ONCE]]).tolist()
        rows = session.execute(
            sa.select(
                poses.image_id,
                poses.mmsi,
                poses.lat_deg,
                poses.lon_deg,
                poses.heading_deg,
                poses.length_m,
                poses.width_m,
            )
            .where(among(poses.id, some))
            .order_by(poses.image_id, poses.id)
        )
        for image_id, *vessel in rows:
            yield image_id, tuple(vessel)


def set_status(session: Session, export_id: int, status: ExportStatus, **columns: object) -> bool:
    """Change where an export stands, unless it was cancelled; whether it was not."""
    changed = session.scalar(
        sa.update(Export)
        .where(Export.id == export_id, Export.status != ExportStatus.CANCELLED)
        .values(status=status, **columns)
        .returning(Export.id)
    )
    return changed is not None


def advance(session: Session, export_id: int, done: int, total: int) -> bool:
    """Say how far an export is; whether it is still wanted."""
    found = session.scalar(
        sa.update(Export)
        .where(Export.id == export_id, Export.status != ExportStatus.CANCELLED)
        .values(item_count=done, item_total=total)
        .returning(Export.id)
    )
    return found is not None


def cancel(session: Session, export_id: int, moment: datetime) -> bool:
    """Cancel an export; False when it has ended."""
    found = session.scalar(
        sa.update(Export)
        .where(Export.id == export_id, Export.status.in_(UNDER_WAY))
        .values(status=ExportStatus.CANCELLED, finished_at=moment)
        .returning(Export.id)
    )
    return found is not None


def id_of_job(session: Session, workflow_id: str) -> int | None:
    """Return the export behind a job."""
    return session.scalar(sa.select(Export.id).where(Export.workflow_id == workflow_id))
