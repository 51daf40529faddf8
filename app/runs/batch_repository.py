"""SQL of a run's batches: what a worker needs to know of some images, and what came of them.

Reading and writing are apart: a worker reads, computes for seconds, and only then writes, so that
nobody waits for the database meanwhile.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, joinedload

from app.db import now
from app.domain.detection import Detection as DetectedBox
from app.domain.detection import passed_over
from app.runs.inheritance_repository import inherit
from app.runs.outcome_repository import ImageOutcome, store_poses
from app.runs.telling import announce_end
from app.tables.deletion import WITH_DELETED
from app.tables.detection import BOX_COLUMNS, Detection, DetectionSet, Model
from app.tables.imagery import Image
from app.tables.runs import Run, RunImage, RunStatus
from app.tables.sites import Site


@dataclass(frozen=True, slots=True)
class RunContext:
    """What all batches of a run share."""

    run: Run
    model: Model
    site: Site


class RunPhotograph(NamedTuple):
    """What a run needs to know of one of its images."""

    id: int
    position: int
    sha256: str
    captured_at: datetime
    deleted_at: datetime | None


@dataclass(frozen=True, slots=True)
class KnownBoxes:
    """What a detector found in an image earlier: a set's id, and its boxes as they were found."""

    id: int
    boxes: list[DetectedBox]


def context(session: Session, run_id: int) -> RunContext:
    """Return a run with its detector and site."""
    run = session.get_one(Run, run_id, options=[joinedload(Run.model)])
    return RunContext(run=run, model=run.model, site=session.get_one(Site, run.site_id))


def images_between(session: Session, run_id: int, start: int, stop: int) -> Sequence[RunPhotograph]:
    """Return the images at some positions of a run, in order, which are not done yet."""
    rows = session.execute(
        sa.select(Image.id, RunImage.position, Image.sha256, Image.captured_at, Image.deleted_at)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(*_waiting(run_id, start, stop))
        .order_by(RunImage.position),
        execution_options=WITH_DELETED,
    )
    return [RunPhotograph(*row) for row in rows]


def unseen(
    session: Session,
    run_id: int,
    start: int,
    stop: int,
    *,
    model_sha256: str,
    settings_sha256: str,
) -> Sequence[str]:
    """Return what is still to be looked at of some positions of a run, by content, in order."""
    is_known = sa.exists().where(
        DetectionSet.image_sha256 == Image.sha256,
        DetectionSet.model_sha256 == model_sha256,
        DetectionSet.settings_sha256 == settings_sha256,
    )
    return session.scalars(
        sa.select(Image.sha256)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(*_waiting(run_id, start, stop), ~is_known)
        .order_by(RunImage.position)
    ).all()


def _waiting(run_id: int, start: int, stop: int) -> tuple[sa.ColumnElement[bool], ...]:
    return (
        RunImage.run_id == run_id,
        RunImage.position >= start,
        RunImage.position < stop,
        RunImage.done_at.is_(None),
    )


def known_detections(
    session: Session, image_sha256s: Sequence[str], model_sha256: str, settings_sha256: str
) -> Mapping[str, KnownBoxes]:
    """Return what the detector is known to have found, by image content."""
    rows = session.execute(
        sa.select(DetectionSet.image_sha256, DetectionSet.id, Detection.id, *BOX_COLUMNS)
        .outerjoin(Detection, Detection.detection_set_id == DetectionSet.id)
        .where(
            DetectionSet.image_sha256.in_(image_sha256s),
            DetectionSet.model_sha256 == model_sha256,
            DetectionSet.settings_sha256 == settings_sha256,
        )
        .order_by(Detection.id)
    )
    known: dict[str, KnownBoxes] = {}
    for sha256, set_id, box_id, *box in rows:
        found = known.setdefault(sha256, KnownBoxes(set_id, []))
        if box_id is not None:  # a set may be empty
            detected = DetectedBox(*box)
            found.boxes.append(detected if detected.has_area else passed_over(detected))
    return known


def begin(session: Session, run_id: int) -> int:
    """Mark a run as running; returns how many images it has."""
    run = session.get_one(Run, run_id)
    if run.status is RunStatus.QUEUED:
        run.status = RunStatus.RUNNING
        run.started_at = now()
    return run.image_count


def finish(session: Session, run_id: int, status: RunStatus, error: str | None = None) -> None:
    """Mark a run as ended, unless it was cancelled meanwhile, and tell the site's webhooks."""
    ended = session.scalar(
        sa.update(Run)
        .where(Run.id == run_id, Run.status.in_((RunStatus.QUEUED, RunStatus.RUNNING)))
        .values(status=status, error=error, finished_at=now())
        .returning(Run.id)
    )
    if ended is not None:
        announce_end(session, run_id)


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
    """Store what came of some images, and that they are done.

    A statement a table, not an image: on SQLite reviewers wait for this to end.
    """
    if not outcomes:
        return
    set_ids = {
        outcome.image_sha256: outcome.detection_set_id
        for outcome in outcomes
        if outcome.detection_set_id is not None
    }
    set_ids |= _store_boxes(session, outcomes, model_sha256, settings_sha256)
    store_poses(session, run_id, outcomes, set_ids)
    inherit(session, run_id, [outcome.image_id for outcome in outcomes if outcome.poses])
    done_at = now()
    session.execute(
        sa.update(RunImage),
        [
            {
                "run_id": run_id,
                "image_id": outcome.image_id,
                "done_at": done_at,
                "detection_set_id": set_ids.get(outcome.image_sha256),
                "error": outcome.error,
                "water_level_m": outcome.water.level_m if outcome.water else None,
                "water_level_source": outcome.water.source.value if outcome.water else None,
            }
            for outcome in outcomes
        ],
    )


def _store_boxes(
    session: Session, outcomes: Sequence[ImageOutcome], model_sha256: str, settings_sha256: str
) -> dict[str, int]:
    """Store new boxes once; returns all their sets by image content.

    Another run may just have stored the same ones for the same content.
    """
    boxes = {
        outcome.image_sha256: outcome.new_boxes
        for outcome in outcomes
        if outcome.new_boxes is not None
    }
    if not boxes:
        return {}
    insert = (sqlite if session.get_bind().dialect.name == "sqlite" else postgresql).insert
    key = {"model_sha256": model_sha256, "settings_sha256": settings_sha256, "created_at": now()}
    inserted = session.execute(
        insert(DetectionSet)
        .on_conflict_do_nothing()
        .returning(DetectionSet.id, DetectionSet.image_sha256),
        [{"image_sha256": sha256, **key} for sha256 in boxes],
    )
    ours = {row[1]: row[0] for row in inserted}
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
        for sha256, set_id in ours.items()
        for box in boxes[sha256]
    ]
    if rows:
        session.execute(sa.insert(Detection), rows)
    others = [sha256 for sha256 in boxes if sha256 not in ours]
    known = known_detections(session, others, model_sha256, settings_sha256) if others else {}
    return ours | {sha256: found.id for sha256, found in known.items()}
