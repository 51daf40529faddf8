"""Clock offsets of cameras: which one counts at a moment, and what follows when that changes.

True time = what the camera's clock said + the offset that counts then. Offsets are never edited: a
newer one wins where it covers a moment, and undoing it lets the earlier one count again. Images get
their times and viewports anew, and runs that used the old ones are marked stale.
"""

import uuid
from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from app.clocks import repository
from app.db import now
from app.errors import Conflict, Invalid, NotFound
from app.imagery import service as imagery
from app.imagery.true_time import corrected_times
from app.jobs import JobClient, JobQueue
from app.tables.clock import ClockEstimate, ClockOffset, EstimateStatus, OffsetSource
from app.tables.runs import Run
from app.tables.sites import Camera

ESTIMATE_JOB = "estimate_clock"
LARGEST_OFFSET_S = 10 * 366 * 86_400.0


def history(session: Session, camera_id: int) -> Sequence[ClockOffset]:
    """Return a camera's offsets, undone ones too, newest first."""
    return repository.offsets(session, camera_id)


def get_offset(session: Session, offset_id: int) -> ClockOffset:
    """Return an offset. Raises NotFound."""
    row = repository.offset(session, offset_id)
    if row is None:
        raise NotFound("there is no such clock offset")
    return row


def add_offset(session: Session, row: ClockOffset) -> int:
    """Store an offset and correct the images it concerns; returns how many changed.

    Raises Invalid naming the field.
    """
    if not abs(row.offset_s) <= LARGEST_OFFSET_S:
        raise Invalid.field("offset_s", "must be at most ten years")
    if row.valid_from and row.valid_until and row.valid_from >= row.valid_until:
        raise Invalid.field("valid_until", "must come after valid_from")
    session.add(row)
    session.flush()
    return _retime(session, row.camera_id)


def offset_of_estimate(estimate: ClockEstimate) -> ClockOffset:
    """Return the offset that an estimate proposes. Raises Conflict when it proposes none."""
    result = estimate.result
    if result is None or not result["is_off"]:
        raise Conflict("this estimate proposes no offset")
    return ClockOffset(
        camera_id=estimate.camera_id,
        valid_from=estimate.begin,
        valid_until=estimate.end,
        offset_s=result["offset_s"],
        low_s=result["low_s"],
        high_s=result["high_s"],
        source=OffsetSource.ESTIMATED,
        concerns_given=result.get("concerns_given", False),
        note=f"estimate {estimate.id} from run {estimate.run_id}",
    )


def undo(session: Session, row: ClockOffset) -> int:
    """Let what was before an offset count again; returns how many images changed."""
    if row.undone_at is not None:
        raise Conflict("this offset was undone already")
    row.undone_at = now()
    session.flush()
    return _retime(session, row.camera_id)


def _retime(session: Session, camera_id: int) -> int:
    images = repository.images_of(session, camera_id)
    told = [(image.captured_at_raw, image.captured_at_source) for image in images]
    changed = 0
    for image, moment in zip(images, corrected_times(session, camera_id, told), strict=True):
        if image.captured_at != moment:
            image.captured_at, image.changed_at = moment, now()
            changed += 1
    session.flush()
    imagery.assign_viewports(session, camera_id)
    return changed


def start_estimate(
    session: Session,
    jobs: JobClient,
    camera: Camera,
    run: Run,
    begin: datetime | None,
    end: datetime | None,
    user_id: int | None,
) -> ClockEstimate:
    """Have a worker tell the offset from a run's images. Raises Invalid (another camera's run)."""
    if run.viewport.camera_id != camera.id:
        raise Invalid.field("run_id", "is a run of another camera")
    if begin and end and begin >= end:
        raise Invalid.field("end", "must come after begin")
    row = ClockEstimate(
        camera_id=camera.id,
        run_id=run.id,
        begin=begin,
        end=end,
        workflow_id=f"clock-{uuid.uuid4()}",
        created_by_id=user_id,
        status=EstimateStatus.QUEUED,
    )
    session.add(row)
    session.flush()
    jobs.enqueue(session, ESTIMATE_JOB, row.id, queue=JobQueue.SHORT, job_id=row.workflow_id)
    return row


def get_estimate(session: Session, estimate_id: int) -> ClockEstimate:
    """Return an estimate. Raises NotFound."""
    row = repository.estimate(session, estimate_id)
    if row is None:
        raise NotFound("there is no such estimate")
    return row


def estimates(session: Session, camera_id: int, limit: int = 20) -> Sequence[ClockEstimate]:
    """Return a camera's newest estimates."""
    return repository.estimates(session, camera_id, limit)


def runs_to_ask(session: Session, camera_id: int) -> Sequence[Run]:
    """Return the runs whose images may tell of a camera's clock, newest first."""
    return repository.runs_of(session, camera_id, 20)


def suspicions(session: Session, run_id: int) -> list[ClockEstimate]:
    """Return why a run withheld matches: what it found wrong with its camera's clock, by time."""
    return repository.suspicions(session, run_id)
