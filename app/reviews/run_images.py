"""The images of a run as a reviewer goes through them, with and without poses.

An image is complete when a person said that every visible vessel is accounted for: each pose is
graded, and each vessel without one is marked as missed with its reason. So the figures that count
vessels, not poses, rest on complete images alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.db import now
from app.deletions import service as deletions
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.paging import Paging
from app.reviews import image_repository as repository
from app.reviews import queue_items
from app.reviews.image_repository import ImageFilters
from app.tables.ais import Vessel
from app.tables.detection import Detection
from app.tables.imagery import Image
from app.tables.reviews import ImageCompletion, MissedReason, MissedVessel
from app.tables.runs import Run, RunImage, VesselStateRow


@dataclass(frozen=True, slots=True)
class ImageOfRun:
    """An image of a run and how far its reviewing is."""

    row: RunImage
    image: Image
    poses: int
    graded: int
    missed: int
    completion: ImageCompletion | None


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle in the image, px; pixel (0, 0) is the centre of the first pixel."""

    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float


def site_of_image(session: Session, image_id: int) -> int:
    """Return the site of a present image. Raises NotFound."""
    image = repository.image(session, image_id)
    if image is None:
        raise NotFound("there is no such image")
    return image.site_id


def run_over(session: Session, access: Access, scope: Scope, run_id: int, image_id: int) -> Run:
    """Return a run that is over an image. Raises NotFound, Forbidden, Invalid naming `run_id`."""
    access.require(scope, site_of_image(session, image_id))
    run = repository.run_over(session, run_id, image_id)
    if run is None:
        raise Invalid.field("run_id", "is not the id of a run over this image")
    return run


def listed(
    session: Session, run_id: int, wanted: ImageFilters, paging: Paging
) -> tuple[list[ImageOfRun], str | None]:
    """Return a page of a run's images in the order of their time."""
    rows, cursor = repository.images_of_run(session, run_id, wanted, paging)
    ids = [row.image_id for row in rows]
    images = repository.images(session, ids)
    poses = repository.pose_counts(session, run_id, ids)
    missed = repository.missed_counts(session, run_id, ids)
    completions = repository.completions(session, run_id, ids)
    found = [
        ImageOfRun(
            row,
            images[row.image_id],
            *poses.get(row.image_id, (0, 0)),
            missed.get(row.image_id, 0),
            completions.get(row.image_id),
        )
        for row in rows
    ]
    return found, cursor


def complete(
    session: Session, run: Run, image_id: int, user_id: int
) -> tuple[ImageCompletion, bool]:
    """Say that every visible vessel of an image is accounted for; True when that is new.

    Raises Conflict naming the poses that nobody has graded.
    """
    repository.lock_image(session, image_id)
    left = repository.ungraded(session, run.id, image_id)
    if left:
        some = ", ".join(str(pose_id) for pose_id in left[:5])
        message = f"{len(left)} of them are not graded yet ({some}); grade them first"
        raise Conflict(
            f"poses: {message}",
            fields=(FieldError("poses", message),),
            more={"ungraded": list(left)},
        )
    at = now()
    is_new = repository.complete(session, run.id, image_id, user_id, at)
    if is_new:
        queue_items.note_completed(session, run.id, image_id, user_id, at)
    return repository.completions(session, run.id, [image_id])[image_id], is_new


def reopen(session: Session, run: Run, image_id: int, user_id: int) -> bool:
    """Take back that an image is complete; False when it was not."""
    repository.lock_image(session, image_id)
    was_complete = repository.reopen(session, run.id, image_id)
    if was_complete:
        queue_items.reopen_image(session, run.id, image_id, user_id, now())
    return was_complete


def missed_of_image(
    session: Session, run_id: int | None, image_id: int, paging: Paging
) -> tuple[Sequence[MissedVessel], str | None]:
    """Return a page of the vessels missed in an image, in one run or in all."""
    return repository.missed_of_image(session, run_id, image_id, paging)


def get_missed(session: Session, missed_id: int) -> MissedVessel:
    """Return a missed vessel. Raises NotFound."""
    found = repository.missed(session, missed_id)
    if found is None:
        raise NotFound("there is no such missed vessel")
    return found


def add_missed(
    session: Session,
    run: Run,
    image_id: int,
    user_id: int,
    box: Box,
    reason: MissedReason,
    comment: str | None,
) -> MissedVessel:
    """Mark a visible vessel that has no pose. Raises Invalid naming a side of the box."""
    _check(session, image_id, box)
    found = MissedVessel(
        image_id=image_id,
        run_id=run.id,
        user_id=user_id,
        x1_px=box.x1_px,
        y1_px=box.y1_px,
        x2_px=box.x2_px,
        y2_px=box.y2_px,
        reason=reason,
        comment=comment or None,
    )
    session.add(found)
    session.flush()
    return found


def change_missed(session: Session, found: MissedVessel, changes: dict[str, object]) -> None:
    """Change a missed vessel. Raises Invalid naming a side of the box."""
    for name, value in changes.items():
        setattr(found, name, value)
    with session.no_autoflush:
        _check(session, found.image_id, Box(found.x1_px, found.y1_px, found.x2_px, found.y2_px))
    session.flush()


def delete_missed(session: Session, found: MissedVessel, user_id: int) -> None:
    """Unmark a missed vessel, for 30 days."""
    image = repository.image(session, found.image_id)
    if image is None:
        raise NotFound("there is no such image")
    deletions.delete(
        session,
        "missed_vessel",
        [found.id],
        site_id=image.site_id,
        label=f"{found.reason.value.replace('_', ' ')}, in {image.file_name}",
        user_id=user_id,
    )


def _check(session: Session, image_id: int, box: Box) -> None:
    """Demand a box inside the image, whose edges are half a pixel beyond the outermost centres."""
    image = repository.image(session, image_id)
    if image is None:
        raise NotFound("there is no such image")
    for axis, size in (("x", image.width_px), ("y", image.height_px)):
        low, high = getattr(box, f"{axis}1_px"), getattr(box, f"{axis}2_px")
        for name, value in ((f"{axis}1_px", low), (f"{axis}2_px", high)):
            if not -0.5 <= value <= size - 0.5:
                raise Invalid.field(name, f"must lie in the image, from -0.5 to {size - 0.5:g}")
        if low >= high:
            raise Invalid.field(f"{axis}2_px", f"must be greater than {axis}1_px")


def vessels(
    session: Session, run_id: int, image_id: int
) -> Sequence[tuple[VesselStateRow, Vessel | None, int | None]]:
    """Return the vessels heard around an image in a run, with the pose of each."""
    return repository.states_of_image(session, run_id, image_id)


def detections(
    session: Session, run_id: int, image_id: int
) -> Sequence[tuple[Detection, int | None]]:
    """Return what was detected in an image of a run, with the pose of each."""
    return repository.detections_of_image(session, run_id, image_id)
