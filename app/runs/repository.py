"""SQL of runs: what is asked of them and how far they are."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.detectors.service import IMPORTED_FAMILY
from app.paging import Paging, fetch_page
from app.tables.detection import Detection, Model, ModelStatus
from app.tables.imagery import Image
from app.tables.registration import Registration, RegistrationMethod
from app.tables.runs import Match, Pose, Run, RunImage, RunStatus, VesselStateRow
from app.tables.sites import Camera, Site, Viewport

POSE_METHODS = (RegistrationMethod.PNP, RegistrationMethod.GIVEN, RegistrationMethod.ROTATION)


@dataclass(frozen=True, slots=True)
class Counts:
    """How far a run is."""

    images_total: int
    images_done: int
    images_failed: int
    detections: int
    matches: int
    poses: int
    last_done_at: datetime | None


def get(session: Session, run_id: int) -> Run | None:
    """Return a run with what it refers to."""
    return find(
        session,
        Run,
        run_id,
        joinedload(Run.model),
        joinedload(Run.viewport).joinedload(Viewport.camera),
    )


def listed(
    session: Session, site_ids: Iterable[int] | None, viewport_id: int | None, paging: Paging
) -> tuple[Sequence[Run], str | None]:
    """Return a page of runs of some sites (None: all), oldest first."""
    statement = sa.select(Run).options(
        joinedload(Run.model), joinedload(Run.viewport).joinedload(Viewport.camera)
    )
    if site_ids is not None:
        statement = statement.where(Run.site_id.in_(site_ids))
    if viewport_id is not None:
        statement = statement.where(Run.viewport_id == viewport_id)
    return fetch_page(session, statement, Run.id, paging)


def newest(session: Session, site_ids: Iterable[int] | None, limit: int) -> Sequence[Run]:
    """Return the newest runs of some sites (None: all)."""
    statement = (
        sa.select(Run)
        .options(joinedload(Run.model), joinedload(Run.viewport).joinedload(Viewport.camera))
        .order_by(Run.id.desc())
        .limit(limit)
    )
    if site_ids is not None:
        statement = statement.where(Run.site_id.in_(site_ids))
    return session.scalars(statement).all()


def latest_registration(session: Session, viewport_id: int) -> Registration | None:
    """Return the newest registration of a viewport that gives a camera pose."""
    return session.scalars(
        sa.select(Registration)
        .where(Registration.viewport_id == viewport_id, Registration.method.in_(POSE_METHODS))
        .order_by(Registration.id.desc())
        .limit(1)
    ).first()


def newest_registration_ids(session: Session, viewport_ids: Iterable[int]) -> dict[int, int]:
    """Return, by viewport, the newest registration that gives a camera pose."""
    rows = session.execute(
        sa.select(Registration.viewport_id, sa.func.max(Registration.id))
        .where(
            Registration.viewport_id.in_(set(viewport_ids)), Registration.method.in_(POSE_METHODS)
        )
        .group_by(Registration.viewport_id)
    )
    return {row[0]: row[1] for row in rows}


def of_viewport(session: Session, viewport_id: int) -> Sequence[Run]:
    """Return a viewport's runs, newest first."""
    return session.scalars(
        sa.select(Run).where(Run.viewport_id == viewport_id).order_by(Run.id.desc())
    ).all()


def ready_model(session: Session, name: str | None) -> Model | None:
    """Return the ready detector with a name, or the newest; imported boxes only if named."""
    statement = sa.select(Model).where(Model.status == ModelStatus.READY)
    if name is None:
        statement = statement.where(Model.family != IMPORTED_FAMILY)
    else:
        statement = statement.where(Model.name == name)
    return session.scalars(statement.order_by(Model.id.desc()).limit(1)).first()


def ready_models(session: Session) -> Sequence[Model]:
    """Return all detectors that may be used."""
    return session.scalars(
        sa.select(Model).where(Model.status == ModelStatus.READY).order_by(Model.name)
    ).all()


def runnable_viewports(
    session: Session, site_ids: Iterable[int] | None
) -> Sequence[tuple[int, str, str, str, int]]:
    """Return (id, site, camera, viewport, image count) of viewports with a pose and images."""
    registered = sa.exists().where(
        Registration.viewport_id == Viewport.id, Registration.method.in_(POSE_METHODS)
    )
    statement = (
        sa.select(Viewport.id, Site.name, Camera.name, Viewport.name, sa.func.count(Image.id))
        .join(Camera, Camera.id == Viewport.camera_id)
        .join(Site, Site.id == Camera.site_id)
        .join(Image, Image.viewport_id == Viewport.id)
        .where(registered, Image.deleted_at.is_(None))
        .group_by(Viewport.id, Site.name, Camera.name, Viewport.name)
        .order_by(Site.name, Camera.name, Viewport.name)
    )
    if site_ids is not None:
        statement = statement.where(Site.id.in_(site_ids))
    return [(row[0], row[1], row[2], row[3], row[4]) for row in session.execute(statement)]


def outcome_counts(session: Session, run_id: int) -> Mapping[str, int]:
    """Count a run's vessel states by what became of them."""
    rows = session.execute(
        sa.select(VesselStateRow.outcome, sa.func.count())
        .where(VesselStateRow.run_id == run_id)
        .group_by(VesselStateRow.outcome)
    )
    return {row[0]: row[1] for row in rows}


def add(session: Session, run: Run) -> int:
    """Store a run with one row for each present image of its viewport; returns their count."""
    session.add(run)
    session.flush()
    numbered = sa.select(
        sa.literal(run.id),
        Image.id,
        sa.func.row_number().over(order_by=(Image.captured_at, Image.id)) - 1,
        Image.captured_at,
    ).where(Image.viewport_id == run.viewport_id, Image.deleted_at.is_(None))
    session.execute(
        sa.insert(RunImage).from_select(["run_id", "image_id", "position", "captured_at"], numbered)
    )
    run.image_count = (
        session.scalar(
            sa.select(sa.func.count()).select_from(RunImage).where(RunImage.run_id == run.id)
        )
        or 0
    )
    return run.image_count


def counts(session: Session, run_ids: Collection[int]) -> Mapping[int, Counts]:
    """Count what each of some runs has made so far."""
    images = {
        row[0]: row
        for row in session.execute(
            sa.select(
                RunImage.run_id,
                sa.func.count(RunImage.done_at),
                sa.func.count(RunImage.error),
                sa.func.max(RunImage.done_at),
                sa.func.count(),
            )
            .where(RunImage.run_id.in_(run_ids))
            .group_by(RunImage.run_id)
        )
    }
    detections = _by_run(
        session,
        sa.select(RunImage.run_id, sa.func.count())
        .join(Detection, Detection.detection_set_id == RunImage.detection_set_id)
        .where(RunImage.run_id.in_(run_ids))
        .group_by(RunImage.run_id),
    )
    matches = _by_run(
        session,
        sa.select(Match.run_id, sa.func.count())
        .where(Match.run_id.in_(run_ids))
        .group_by(Match.run_id),
    )
    poses = _by_run(
        session,
        sa.select(Pose.run_id, sa.func.count())
        .where(Pose.run_id.in_(run_ids))
        .group_by(Pose.run_id),
    )
    found = {}
    for run_id in run_ids:
        _, done, failed, last, total = images.get(run_id, (run_id, 0, 0, None, 0))
        found[run_id] = Counts(
            images_total=total,
            images_done=done,
            images_failed=failed,
            detections=detections.get(run_id, 0),
            matches=matches.get(run_id, 0),
            poses=poses.get(run_id, 0),
            last_done_at=last,
        )
    return found


def _by_run(session: Session, statement: sa.Select[int, int]) -> Mapping[int, int]:
    return {row[0]: row[1] for row in session.execute(statement)}


def image_errors(session: Session, run_id: int, limit: int = 20) -> Sequence[tuple[str, str]]:
    """Return (file name, reason) of the images a run could not use."""
    rows = session.execute(
        sa.select(Image.file_name, RunImage.error)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(RunImage.run_id == run_id, RunImage.error.is_not(None))
        .order_by(RunImage.position)
        .limit(limit)
    )
    return [(name, reason or "") for name, reason in rows]


def of_job(session: Session, workflow_id: str) -> Run | None:
    """Return the run behind a job."""
    return session.scalar(sa.select(Run).where(Run.workflow_id == workflow_id))


def mark_cancelled(session: Session, run_id: int, at: datetime) -> bool:
    """Mark a run as cancelled; False when it has ended already."""
    cancelled = session.scalar(
        sa.update(Run)
        .where(Run.id == run_id, Run.status.in_((RunStatus.QUEUED, RunStatus.RUNNING)))
        .values(status=RunStatus.CANCELLED, finished_at=at)
        .returning(Run.id)
    )
    return cancelled is not None
