"""The SQL of clock offsets and of what images say of clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.domain.detection import Detection as DetectedBox
from app.tables.clock import ClockEstimate, ClockOffset
from app.tables.detection import BOX_COLUMNS, Detection
from app.tables.imagery import Image
from app.tables.live import StandingRun
from app.tables.runs import Match, Run, RunImage, VesselStateRow
from app.tables.sites import Viewport


@dataclass(frozen=True, slots=True)
class DetectedImage:
    """An image of a run, and what was detected on it."""

    image: Image
    detections: Sequence[DetectedBox]


@dataclass(frozen=True, slots=True)
class MatchedBox:
    """A box and where AIS puts its vessel: the middle of its plane segment across the image."""

    mmsi: int
    lat_deg: float
    lon_deg: float
    heading_deg: float
    speed_kn: float
    centre_px: float
    box: DetectedBox


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


def images_of(session: Session, camera_id: int) -> Sequence[Image]:
    """Return a camera's images."""
    return session.scalars(sa.select(Image).where(Image.camera_id == camera_id)).all()


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
    return _with_boxes(session, rows[:: max(1, -(-len(rows) // limit))])


def _with_boxes(
    session: Session, chosen: Sequence[sa.Row[Image, int | None]]
) -> list[DetectedImage]:
    boxes: dict[int | None, list[DetectedBox]] = {row[1]: [] for row in chosen}
    found = session.execute(
        sa.select(Detection.detection_set_id, *BOX_COLUMNS).where(
            Detection.detection_set_id.in_(boxes)
        )
    )
    for set_id, *box in found:
        detected = DetectedBox(*box)
        if detected.has_area:
            boxes[set_id].append(detected)
    return [DetectedImage(row[0], boxes[row[1]]) for row in chosen]


def image_ids_from(session: Session, run_id: int, first: int, before: int) -> list[int]:
    """Return the images of a run with detections, from a position on, in the order of time.

    With up to `before` images that stand before them: few new ones say little by themselves.
    """
    shows_something = sa.exists().where(Detection.detection_set_id == RunImage.detection_set_id)
    of_run = (
        sa.select(Image.id)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(RunImage.run_id == run_id, RunImage.done_at.is_not(None), shows_something)
    )
    earliest = session.scalar(
        sa.select(sa.func.min(Image.captured_at))
        .join(RunImage, RunImage.image_id == Image.id)
        .where(RunImage.run_id == run_id, RunImage.position >= first)
    )
    if earliest is None:
        return []
    earlier = of_run.where(Image.captured_at < earliest).order_by(
        Image.captured_at.desc(), Image.id.desc()
    )
    later = of_run.where(Image.captured_at >= earliest).order_by(Image.captured_at, Image.id)
    found = session.scalars(earlier.limit(before)).all()
    return [*reversed(found), *session.scalars(later)]


def detected_on(session: Session, run_id: int, image_ids: Sequence[int]) -> list[DetectedImage]:
    """Return some images of a run in the order of time, with what was detected on them."""
    rows = session.execute(
        sa.select(Image, RunImage.detection_set_id)
        .join(RunImage, RunImage.image_id == Image.id)
        .where(RunImage.run_id == run_id, Image.id.in_(image_ids))
        .order_by(Image.captured_at, Image.id)
    ).all()
    return _with_boxes(session, rows)


def matched_boxes(session: Session, run_id: int, image_ids: Sequence[int]) -> list[MatchedBox]:
    """Return the matches of a run on some images."""
    state = VesselStateRow
    rows = session.execute(
        sa.select(
            state.segments_px,
            *(state.mmsi, state.lat_deg, state.lon_deg, state.heading_deg, state.speed_kn),
            *BOX_COLUMNS,
        )
        .join(Match, Match.vessel_state_id == state.id)
        .join(Detection, Detection.id == Match.detection_id)
        .where(state.run_id == run_id, state.image_id.in_(image_ids))
    )
    found = []
    for segments_px, mmsi, lat_deg, lon_deg, heading_deg, speed_kn, *box in rows:
        across = [corner[0] for corner in segments_px["dead_reckoned"] if corner is not None]
        if across and None not in across:
            centre_px = (min(across) + max(across)) / 2
            found.append(
                MatchedBox(
                    mmsi, lat_deg, lon_deg, heading_deg, speed_kn, centre_px, DetectedBox(*box)
                )
            )
    return found


def is_standing(session: Session, run_id: int) -> bool:
    """Whether a run grows as images come."""
    found = sa.select(StandingRun.id).where(StandingRun.run_id == run_id)
    return session.scalar(found) is not None


def suspicions(session: Session, run_id: int) -> list[ClockEstimate]:
    """Return what a run found by itself to be wrong with its camera's clock, by time."""
    rows = session.scalars(
        sa.select(ClockEstimate)
        .where(ClockEstimate.run_id == run_id, ClockEstimate.created_by_id.is_(None))
        .order_by(ClockEstimate.begin)
    )
    return [row for row in rows if row.result and "withheld_matches" in row.result]


def forget_suspicions(session: Session, run_id: int, begin: datetime) -> None:
    """Remove what a run found of a time, for it has looked at that again."""
    for row in suspicions(session, run_id):
        if row.begin is not None and row.begin >= begin:
            session.delete(row)
    session.flush()
