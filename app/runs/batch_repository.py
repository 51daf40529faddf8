"""SQL of a run's batches: what a worker needs to know of some images, and what came of them.

Reading and writing are apart: a worker reads, computes for seconds, and only then writes, so that
nobody waits for the database meanwhile.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, joinedload

from app.db import now
from app.domain.detection import Detection as DetectedBox
from app.tables.detection import Detection, DetectionSet, Model
from app.tables.imagery import Image
from app.tables.runs import Match, Pose, Run, RunImage, RunStatus, VesselStateRow
from app.tables.sites import Site


@dataclass(frozen=True, slots=True)
class RunContext:
    """What all batches of a run share."""

    run: Run
    model: Model
    site: Site


@dataclass(frozen=True, slots=True)
class PoseRows:
    """The rows of one pose, still without the ids the database gives."""

    detection_index: int
    state_index: int
    cost: float
    cost_terms: dict[str, float]
    pose: dict[str, Any]


@dataclass(frozen=True, slots=True)
class ImageOutcome:
    """What came of one image: boxes, vessel states and poses, or the reason why nothing did."""

    image_id: int
    image_sha256: str
    detection_set_id: int | None
    new_boxes: Sequence[DetectedBox] | None
    states: Sequence[dict[str, Any]]
    poses: Sequence[PoseRows]
    error: str | None = None


def context(session: Session, run_id: int) -> RunContext:
    """Return a run with its detector and site."""
    run = session.get_one(Run, run_id, options=[joinedload(Run.model)])
    return RunContext(run=run, model=run.model, site=session.get_one(Site, run.site_id))


def images_between(session: Session, run_id: int, start: int, stop: int) -> Sequence[Image]:
    """Return the images at some positions of a run, in order, which are not done yet."""
    return session.scalars(
        sa.select(Image)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(
            RunImage.run_id == run_id,
            RunImage.position >= start,
            RunImage.position < stop,
            RunImage.done_at.is_(None),
        )
        .order_by(RunImage.position)
    ).all()


def known_detections(
    session: Session, image_sha256s: Sequence[str], model_sha256: str, settings_sha256: str
) -> Mapping[str, DetectionSet]:
    """Return what the detector is known to have found, by image content."""
    sets = session.scalars(
        sa.select(DetectionSet)
        .options(joinedload(DetectionSet.detections))
        .where(
            DetectionSet.image_sha256.in_(image_sha256s),
            DetectionSet.model_sha256 == model_sha256,
            DetectionSet.settings_sha256 == settings_sha256,
        )
    ).unique()
    return {found.image_sha256: found for found in sets}


def begin(session: Session, run_id: int) -> int:
    """Mark a run as running; returns how many images it has."""
    run = session.get_one(Run, run_id)
    if run.status is RunStatus.QUEUED:
        run.status = RunStatus.RUNNING
        run.started_at = now()
    return run.image_count


def finish(session: Session, run_id: int, status: RunStatus, error: str | None = None) -> None:
    """Mark a run as ended, unless it was cancelled meanwhile."""
    session.execute(
        sa.update(Run)
        .where(Run.id == run_id, Run.status.in_((RunStatus.QUEUED, RunStatus.RUNNING)))
        .values(status=status, error=error, finished_at=now())
    )


def fail_job(session: Session, workflow_id: str, reason: str) -> None:
    """Mark the run behind a job as failed, with the reason."""
    run_id = session.scalar(sa.select(Run.id).where(Run.workflow_id == workflow_id))
    if run_id is not None:
        finish(session, run_id, RunStatus.FAILED, reason)


def store(
    session: Session,
    run_id: int,
    model_sha256: str,
    settings_sha256: str,
    outcomes: Sequence[ImageOutcome],
) -> None:
    """Store what came of some images, and that they are done."""
    for outcome in outcomes:
        set_id = outcome.detection_set_id
        if outcome.new_boxes is not None:
            set_id = _store_boxes(session, outcome, model_sha256, settings_sha256)
        _store_poses(session, run_id, outcome, _detection_ids(session, set_id))
        session.execute(
            sa.update(RunImage)
            .where(RunImage.run_id == run_id, RunImage.image_id == outcome.image_id)
            .values(done_at=now(), detection_set_id=set_id, error=outcome.error)
        )


def _store_boxes(
    session: Session, outcome: ImageOutcome, model_sha256: str, settings_sha256: str
) -> int:
    """Store boxes once; another run may just have stored the same ones for the same content."""
    insert = (sqlite if session.get_bind().dialect.name == "sqlite" else postgresql).insert
    key = {
        "image_sha256": outcome.image_sha256,
        "model_sha256": model_sha256,
        "settings_sha256": settings_sha256,
    }
    set_id: int | None = session.scalar(
        insert(DetectionSet)
        .values(**key, created_at=now())
        .on_conflict_do_nothing()
        .returning(DetectionSet.id)
    )
    if set_id is None:
        return session.scalars(sa.select(DetectionSet.id).filter_by(**key)).one()
    rows = [
        {
            "detection_set_id": set_id,
            "x1_px": box.x1_px,
            "y1_px": box.y1_px,
            "x2_px": box.x2_px,
            "y2_px": box.y2_px,
            "score": box.score,
            "class_id": box.class_id,
        }
        for box in outcome.new_boxes or ()
    ]
    if rows:
        session.execute(sa.insert(Detection), rows)
    return set_id


def _detection_ids(session: Session, set_id: int | None) -> Sequence[int]:
    if set_id is None:
        return ()
    return session.scalars(
        sa.select(Detection.id).where(Detection.detection_set_id == set_id).order_by(Detection.id)
    ).all()


def _store_poses(
    session: Session, run_id: int, outcome: ImageOutcome, detection_ids: Sequence[int]
) -> None:
    if not outcome.states:
        return
    key = {"run_id": run_id, "image_id": outcome.image_id}
    state_ids = session.scalars(
        sa.insert(VesselStateRow).returning(VesselStateRow.id, sort_by_parameter_order=True),
        [{**key, **state} for state in outcome.states],
    ).all()
    if not outcome.poses:
        return
    match_ids = session.scalars(
        sa.insert(Match).returning(Match.id, sort_by_parameter_order=True),
        [
            {
                "run_id": run_id,
                "detection_id": detection_ids[rows.detection_index],
                "vessel_state_id": state_ids[rows.state_index],
                "cost": rows.cost,
                "cost_terms": rows.cost_terms,
            }
            for rows in outcome.poses
        ],
    ).all()
    session.execute(
        sa.insert(Pose),
        [
            {**key, **rows.pose, "match_id": match_id}
            for rows, match_id in zip(outcome.poses, match_ids, strict=True)
        ],
    )
