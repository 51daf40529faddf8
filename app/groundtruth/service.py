"""Photographs with boxes that people drew: getting one, changing its boxes, saying it is complete.

A photograph that people draw in becomes a *ground truth image*. One that came with a file may be
absent here; it is known by its file's name and size, and is linked to the photograph when that has
come and a person says so.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.db import now
from app.edits import flush_edit
from app.errors import Conflict, Invalid, NotFound
from app.groundtruth import repository
from app.groundtruth.repository import BoxFilters, ImageFilters
from app.imagery import service as imagery
from app.paging import Paging
from app.tables.groundtruth import (
    GroundTruthBox,
    GroundTruthFile,
    GroundTruthImage,
    VesselClass,
)
from app.tables.imagery import Image

LEAST_SIDE_PX = 1.0


@dataclass(frozen=True, slots=True)
class Totals:
    """How many photographs, how many of them here and complete, and how many boxes."""

    images: int = 0
    here: int = 0
    complete: int = 0
    boxes: int = 0


def get_image(session: Session, ground_truth_image_id: int) -> GroundTruthImage:
    """Return a ground truth image. Raises NotFound."""
    found = repository.image(session, ground_truth_image_id)
    if found is None:
        raise NotFound(f"there is no ground truth image {ground_truth_image_id}")
    return found


def get_box(session: Session, box_id: int, *, deleted: bool = False) -> GroundTruthBox:
    """Return a box. Raises NotFound, also for a deleted one unless it is asked for."""
    found = repository.box(session, box_id)
    if found is None or (found.deleted_at is not None and not deleted):
        raise NotFound(f"there is no ground truth box {box_id}")
    return found


def get_file(session: Session, file_id: int) -> GroundTruthFile:
    """Return an imported file. Raises NotFound."""
    found = repository.file(session, file_id)
    if found is None:
        raise NotFound(f"there is no ground truth file {file_id}")
    return found


def list_boxes(
    session: Session, wanted: BoxFilters, paging: Paging
) -> tuple[Sequence[GroundTruthBox], str | None]:
    """Return a part of the list of boxes."""
    return repository.boxes(session, wanted, paging)


def list_images(
    session: Session, wanted: ImageFilters, paging: Paging
) -> tuple[Sequence[GroundTruthImage], str | None]:
    """Return a part of the list of ground truth images."""
    return repository.images(session, wanted, paging)


def list_files(
    session: Session, site_ids: frozenset[int] | None, paging: Paging
) -> tuple[Sequence[GroundTruthFile], str | None]:
    """Return a part of the list of imported files."""
    return repository.files(session, site_ids, paging)


def boxes_of(session: Session, image: GroundTruthImage) -> Sequence[GroundTruthBox]:
    """Return the boxes of a ground truth image."""
    return repository.boxes_of(session, image.id)


def count_boxes(session: Session, images: Sequence[GroundTruthImage]) -> Mapping[int, int]:
    """Count the boxes of ground truth images, by id."""
    return repository.count_boxes(session, [image.id for image in images])


def totals_by_site(session: Session, site_ids: Sequence[int]) -> Mapping[int, Totals]:
    """Count what there is at sites."""
    found = repository.totals(session, GroundTruthImage.site_id, site_ids)
    return {key: Totals(*counts) for key, counts in found.items()}


def totals_by_file(session: Session, file_ids: Sequence[int]) -> Mapping[int, Totals]:
    """Count what is left of imported files."""
    found = repository.totals(session, GroundTruthImage.file_id, file_ids)
    return {key: Totals(*counts) for key, counts in found.items()}


def image_of_photograph(session: Session, image_id: int) -> tuple[GroundTruthImage, bool]:
    """Return the ground truth image of a photograph, and whether it is new. Raises NotFound."""
    found = repository.of_photograph(session, image_id)
    if found is not None:
        return found, False
    photo = imagery.get_image(session, image_id)
    image = GroundTruthImage(
        site_id=photo.site_id,
        image_id=photo.id,
        file_name=photo.file_name,
        base_name=photo.file_name,
        width_px=photo.width_px,
        height_px=photo.height_px,
        content_sha256=photo.sha256,
    )
    session.add(image)
    session.flush()
    return image, True


def drawn_in(session: Session, image_id: int) -> GroundTruthImage | None:
    """Return the ground truth image of a photograph, None while nobody has drawn in it."""
    return repository.of_photograph(session, image_id)


def first_photograph(session: Session, site_id: int) -> int | None:
    """Return a site's first photograph whose boxes are not complete."""
    return repository.first_photograph(session, site_id)


def next_open(session: Session, photo: Image) -> int | None:
    """Return the next photograph of the camera whose boxes are not complete, by time."""
    return repository.next_open(session, photo)


def add_box(
    session: Session,
    image: GroundTruthImage,
    user_id: int,
    place_px: Mapping[str, float],
    vessel_class: VesselClass,
    *,
    is_crowd: bool = False,
) -> GroundTruthBox:
    """Draw a box. Raises Invalid for one that is empty or reaches out of its image."""
    box = GroundTruthBox(
        ground_truth_image_id=image.id,
        vessel_class=vessel_class,
        is_crowd=is_crowd,
        user_id=user_id,
        area_px2=0.0,
        **place_px,
    )
    _check_place(box, image)
    box.area_px2 = _area_px2(box)
    session.add(box)
    session.flush()
    repository.touch(session, image)
    return box


def change_box(
    session: Session, box: GroundTruthBox, user_id: int, changes: Mapping[str, Any]
) -> None:
    """Move a box or give it another class. Raises Invalid, PreconditionFailed."""
    before = (box.x1_px, box.y1_px, box.x2_px, box.y2_px)
    for name, value in changes.items():
        setattr(box, name, value)
    if before != (box.x1_px, box.y1_px, box.x2_px, box.y2_px):
        _check_place(box, box.image)
        box.area_px2 = _area_px2(box)
    box.user_id = user_id
    flush_edit(session)
    repository.touch(session, box.image)


def delete_box(session: Session, box: GroundTruthBox) -> None:
    """Take a box away; it can be brought back."""
    repository.mark_deleted(box, deleted=True)
    flush_edit(session)
    repository.touch(session, box.image)


def restore_box(session: Session, box: GroundTruthBox) -> None:
    """Bring a deleted box back. Raises Conflict for one that is there."""
    if box.deleted_at is None:
        raise Conflict("this box is there already")
    repository.mark_deleted(box, deleted=False)
    flush_edit(session)
    repository.touch(session, box.image)


def set_complete(
    session: Session, image: GroundTruthImage, user_id: int, *, complete: bool
) -> None:
    """Say that every vessel of an image has its box, or that it is not so."""
    image.is_complete = complete
    image.completed_at = now() if complete else None
    image.completed_by_id = user_id if complete else None
    flush_edit(session)


def absent_that_came(session: Session, site_id: int) -> list[tuple[GroundTruthImage, Image]]:
    """Return absent photographs of a site that are here now: one of the same name and size each."""
    missing = repository.absent(session, site_id)
    photos = repository.photographs_named(session, site_id, (one.base_name for one in missing))
    pairs = []
    for one in missing:
        # Taken out, because a photograph can be linked once.
        found = photos.pop((one.base_name, one.width_px, one.height_px), [])
        if len(found) == 1:
            pairs.append((one, found[0]))
    return pairs


def link(session: Session, site_id: int) -> int:
    """Link absent photographs of a site with those that have come since; return how many."""
    pairs = absent_that_came(session, site_id)
    for image, photo in pairs:
        repository.move_detections(session, image.content_sha256, photo.sha256)
        image.image_id, image.content_sha256 = photo.id, photo.sha256
    flush_edit(session)
    return len(pairs)


def stand_in_sha256(site_id: int, base_name: str, width_px: int, height_px: int) -> str:
    """Return the key under which detections of an absent photograph are stored."""
    words = f"absent photograph\0{site_id}\0{base_name}\0{width_px}\0{height_px}"
    return hashlib.sha256(words.encode()).hexdigest()


def _area_px2(box: GroundTruthBox) -> float:
    return (box.x2_px - box.x1_px) * (box.y2_px - box.y1_px)


def _check_place(box: GroundTruthBox, image: GroundTruthImage) -> None:
    for low, high in (("x1_px", "x2_px"), ("y1_px", "y2_px")):
        if getattr(box, high) - getattr(box, low) < LEAST_SIDE_PX:
            raise Invalid.field(high, f"must be at least {LEAST_SIDE_PX:g} px more than {low}")
    for name, most in (("x2_px", image.width_px), ("y2_px", image.height_px)):
        if getattr(box, name) > most:
            raise Invalid.field(name, f"lies outside of the image, which ends at {most} px")
    for name in ("x1_px", "y1_px"):
        if getattr(box, name) < 0:
            raise Invalid.field(name, "lies outside of the image, which begins at 0 px")
