"""Starting, watching and ending re-registrations.

What a job is about is frozen when it is asked for: the registration it starts from, the reference
photograph, the gate and the list of images, so that it can be explained later and taken over by
another worker at any image.
"""

import uuid
from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from app.domain.reregistration import MOVEMENT_ALARM_DEG, Refusal
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.imagery import service as imagery
from app.jobs import JobClient, JobQueue
from app.paging import Paging
from app.registration import service as registration
from app.reregistration import repository
from app.reregistration.schemas import Counts, ReregistrationIn, ReregistrationOut
from app.sites.fields import in_zone
from app.tables.imagery import Image
from app.tables.reregistration import (
    Pointing,
    Reregistration,
    ReregistrationImage,
    ReregistrationStatus,
)
from app.tables.sites import Viewport

REREGISTRATION_JOB = "reregister"
ENDED = frozenset(ReregistrationStatus) - frozenset(repository.OPEN)
REFUSALS = {
    Refusal.UNREADABLE: "The file cannot be decoded",
    Refusal.WRONG_SIZE: "Another size than the camera's images",
    Refusal.NO_STRUCTURE: "Hardly anything to recognise: fog, night, or a blank picture",
    Refusal.TOO_FEW_INLIERS: "Too few points of the known scenery found again",
    Refusal.TOO_SMALL_AREA: "What was found again lies in too small a part of the picture",
    Refusal.TURNED_TOO_FAR: "Turned further than the gate allows",
    Refusal.TWO_MOTIONS: "Two motions are seen: a large vessel may hide the scenery",
    Refusal.UNCERTAIN: "The turn is too uncertain",
}


def start(
    session: Session,
    jobs: JobClient,
    viewport: Viewport,
    data: ReregistrationIn,
    user_id: int | None,
) -> Reregistration:
    """Store a re-registration and put its job into the queue.

    Raises Conflict (no registration, no reference, no image to look at), Invalid (reference,
    times).
    """
    found = registration.current_registrations(session, [viewport.id]).get(viewport.id)
    if found is None:
        raise _not_ready("has no camera pose yet; register it by its keypoints first")
    timezone = viewport.camera.timezone
    begin = data.begin and in_zone(data.begin, timezone, "from")
    end = data.end and in_zone(data.end, timezone, "until")
    if begin is not None and end is not None and begin >= end:
        raise Invalid.field("until", "must come after from")
    row = Reregistration(
        site_id=viewport.camera.site_id,
        viewport_id=viewport.id,
        registration_id=found.id,
        reference_image_id=_reference(session, viewport, data.reference_image_id).id,
        settings=data.model_dump(mode="json", by_alias=True),
        workflow_id=f"reregister-{uuid.uuid4()}",
        created_by_id=user_id,
    )
    if repository.add(session, row, data.images, begin, end) == 0:
        raise _not_ready(
            f"has no such images to look at ({data.images.value}); upload some, or choose others"
        )
    jobs.enqueue(session, REREGISTRATION_JOB, row.id, queue=JobQueue.RUNS, job_id=row.workflow_id)
    return row


def _reference(session: Session, viewport: Viewport, image_id: int | None) -> Image:
    if image_id is None:
        first = repository.first_image(session, viewport.id)
        if first is None:
            raise _not_ready(
                "has no image; the turn is told against the photograph it was registered on, so "
                "upload that first"
            )
        return first
    try:
        image = imagery.get_image(session, image_id)
    except NotFound as error:
        raise Invalid.field("reference_image_id", "there is no such image") from error
    if image.viewport_id != viewport.id:
        # Said alike of an image of another site: whose it is is nobody's business.
        raise Invalid.field("reference_image_id", "there is no such image in this viewport")
    return image


def _not_ready(reason: str) -> Conflict:
    return Conflict(f"the viewport {reason}", fields=(FieldError("viewport_id", reason),))


def get(session: Session, reregistration_id: int) -> Reregistration:
    """Return a re-registration. Raises NotFound."""
    row = repository.get(session, reregistration_id)
    if row is None:
        raise NotFound("there is no such re-registration")
    return row


def shown(session: Session, rows: Sequence[Reregistration]) -> list[ReregistrationOut]:
    """Tell of re-registrations how far they are."""
    counts = repository.counts(session, [row.id for row in rows])
    return [ReregistrationOut.of(row, counts.get(row.id, Counts())) for row in rows]


def list_reregistrations(
    session: Session, site_ids: frozenset[int] | None, viewport_id: int | None, paging: Paging
) -> tuple[Sequence[Reregistration], str | None]:
    """Return a page of the re-registrations of some sites (None: all)."""
    return repository.listed(session, site_ids, viewport_id, paging)


def newest(session: Session, viewport_id: int, limit: int = 10) -> Sequence[Reregistration]:
    """Return a viewport's newest re-registrations."""
    return repository.newest(session, viewport_id, limit)


def images(
    session: Session,
    reregistration_id: int,
    *,
    passed: bool | None = None,
    pointing_id: int | None = None,
    after: int = -1,
    limit: int = 1000,
) -> Sequence[ReregistrationImage]:
    """Return images of a re-registration in order of time."""
    return repository.images(
        session,
        reregistration_id,
        passed=passed,
        pointing_id=pointing_id,
        after=after,
        limit=limit,
    )


def pointings(session: Session, reregistration_id: int) -> Sequence[Pointing]:
    """Return the pointings of a re-registration in order of time."""
    return repository.pointings(session, reregistration_id)


def get_pointing(session: Session, pointing_id: int) -> Pointing:
    """Return a pointing. Raises NotFound."""
    row = repository.pointing(session, pointing_id)
    if row is None:
        raise NotFound("there is no such pointing")
    return row


def image_of(session: Session, pointing: Pointing, image_id: int | None) -> ReregistrationImage:
    """Return an image of a pointing, the one with the most support by default. Raises NotFound."""
    if image_id is None:
        row = repository.strongest(session, pointing.id)
    else:
        row = repository.turned_image(session, pointing.reregistration_id, image_id)
    if row is None or row.pointing_id != pointing.id:
        raise NotFound("there is no such image in this pointing")
    return row


def mark_cancelled(session: Session, reregistration_id: int) -> bool:
    """Mark as cancelled; its job must have been stopped before. False when it had ended."""
    return repository.finish(session, reregistration_id, ReregistrationStatus.CANCELLED)


def fail(session: Session, reregistration_id: int, reason: str) -> None:
    """Mark as failed, with the reason."""
    repository.finish(session, reregistration_id, ReregistrationStatus.FAILED, reason)


def fail_job(session: Session, workflow_id: str, reason: str) -> None:
    """Mark the re-registration behind a job as failed, with the reason."""
    reregistration_id = repository.id_of_job(session, workflow_id)
    if reregistration_id is not None:
        fail(session, reregistration_id, reason)


class Movement:
    """What is to be told of a camera or viewport that has moved."""

    def __init__(self, row: tuple[int, int, int, float, datetime]) -> None:
        self.viewport_id, self.reregistration_id, self.image_count = row[:3]
        self.angle_deg, self.since = row[3:]


def movements(session: Session, viewport_ids: Sequence[int]) -> list[Movement]:
    """Return which viewports hold images that look another way: the movement alarm."""
    return [Movement(row) for row in repository.moved(session, viewport_ids, MOVEMENT_ALARM_DEG)]


def waiting(session: Session, camera_id: int) -> tuple[int, int | None]:
    """Count a camera's undecided pointings; with the newest re-registration that has some."""
    return repository.waiting_pointings(session, camera_id)
