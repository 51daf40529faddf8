"""The SQL of clock offsets and of what images say of clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.tables.clock import ClockEstimate, ClockOffset
from app.tables.detection import Detection
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.runs import Run, RunImage
from app.tables.sites import Viewport


@dataclass(frozen=True, slots=True)
class DetectedImage:
    """An image of a run, and what was detected on it."""

    image: Image
    detections: Sequence[Detection]


def offsets(session: Session, camera_id: int) -> Sequence[ClockOffset]:
    """Return a camera's offsets, undone ones too, newest first."""
    return session.scalars(
        sa.select(ClockOffset)
        .where(ClockOffset.camera_id == camera_id)
        .order_by(ClockOffset.id.desc())
    ).all()


def offset(session: Session, offset_id: int) -> ClockOffset | None:
    """Return an offset."""
    return find(session, ClockOffset, offset_id)


def retime(
    session: Session, camera_id: int, sources: Sequence[CaptureTimeSource]
) -> Sequence[Image]:
    """Return a camera's images whose time its clock told."""
    return session.scalars(
        sa.select(Image).where(Image.camera_id == camera_id, Image.captured_at_source.in_(sources))
    ).all()


def estimates(session: Session, camera_id: int, limit: int) -> Sequence[ClockEstimate]:
    """Return a camera's estimates, newest first."""
    return session.scalars(
        sa.select(ClockEstimate)
        .where(ClockEstimate.camera_id == camera_id)
        .order_by(ClockEstimate.id.desc())
        .limit(limit)
    ).all()


def estimate(session: Session, estimate_id: int) -> ClockEstimate | None:
    """Return an estimate."""
    return find(session, ClockEstimate, estimate_id)


def estimate_of_job(session: Session, workflow_id: str) -> ClockEstimate | None:
    """Return the estimate behind a job."""
    return session.scalar(sa.select(ClockEstimate).where(ClockEstimate.workflow_id == workflow_id))


def runs_of(session: Session, camera_id: int, limit: int) -> Sequence[Run]:
    """Return a camera's newest runs."""
    return session.scalars(
        sa.select(Run)
        .join(Viewport, Viewport.id == Run.viewport_id)
        .where(Viewport.camera_id == camera_id)
        .order_by(Run.id.desc())
        .limit(limit)
    ).all()


def detected(
    session: Session, run_id: int, begin: datetime | None, end: datetime | None, limit: int
) -> list[DetectedImage]:
    """Return up to `limit` images of a run on which something was detected, spread over its time.

    `begin` and `end` are by the camera's clock.
    """
    statement = (
        sa.select(Image, RunImage.detection_set_id)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(
            RunImage.run_id == run_id,
            sa.exists().where(Detection.detection_set_id == RunImage.detection_set_id),
        )
        .order_by(Image.captured_at)
    )
    if begin is not None:
        statement = statement.where(Image.captured_at_raw >= begin)
    if end is not None:
        statement = statement.where(Image.captured_at_raw < end)
    rows = session.execute(statement).all()
    chosen = rows[:: max(1, -(-len(rows) // limit))]
    boxes: dict[int | None, list[Detection]] = {row[1]: [] for row in chosen}
    found = session.scalars(sa.select(Detection).where(Detection.detection_set_id.in_(boxes)))
    for box in found:
        boxes[box.detection_set_id].append(box)
    return [DetectedImage(row[0], boxes[row[1]]) for row in chosen]
