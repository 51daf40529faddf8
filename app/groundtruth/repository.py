"""The SQL of ground truth in two dimensions."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find, now
from app.paging import Paging, fetch_page
from app.tables.detection import DetectionSet
from app.tables.groundtruth import (
    GroundTruthBox,
    GroundTruthFile,
    GroundTruthImage,
    VesselClass,
)
from app.tables.imagery import Image

_NAMES_AT_ONCE = 500


@dataclass(frozen=True, slots=True)
class BoxFilters:
    """Which boxes are asked for; None: all. `site_ids` are those one may read."""

    site_ids: frozenset[int] | None
    site_id: int | None = None
    image_id: int | None = None
    ground_truth_image_id: int | None = None
    file_id: int | None = None
    vessel_class: VesselClass | None = None


@dataclass(frozen=True, slots=True)
class ImageFilters:
    """Which photographs are asked for; None: all. `site_ids` are those one may read."""

    site_ids: frozenset[int] | None
    site_id: int | None = None
    image_id: int | None = None
    file_id: int | None = None
    complete: bool | None = None
    here: bool | None = None


def file(session: Session, file_id: int) -> GroundTruthFile | None:
    """Return an imported file."""
    return find(session, GroundTruthFile, file_id)


def image(session: Session, ground_truth_image_id: int) -> GroundTruthImage | None:
    """Return a photograph that people drew boxes in."""
    return find(session, GroundTruthImage, ground_truth_image_id)


def box(session: Session, box_id: int) -> GroundTruthBox | None:
    """Return a box with its photograph; deleted ones, too."""
    return find(session, GroundTruthBox, box_id, joinedload(GroundTruthBox.image))


def file_of_content(session: Session, site_id: int, sha256: str) -> GroundTruthFile | None:
    """Return the file with these bytes that was imported for a site."""
    return session.scalars(
        sa.select(GroundTruthFile).where(
            GroundTruthFile.site_id == site_id, GroundTruthFile.sha256 == sha256
        )
    ).first()


def files(
    session: Session, site_ids: frozenset[int] | None, paging: Paging
) -> tuple[Sequence[GroundTruthFile], str | None]:
    """Return a part of the list of imported files."""
    statement = sa.select(GroundTruthFile)
    if site_ids is not None:
        statement = statement.where(GroundTruthFile.site_id.in_(site_ids))
    return fetch_page(session, statement, GroundTruthFile.id, paging)


def of_photograph(session: Session, image_id: int) -> GroundTruthImage | None:
    """Return what people drew in a photograph that is here."""
    return session.scalars(
        sa.select(GroundTruthImage).where(GroundTruthImage.image_id == image_id)
    ).first()


def images(
    session: Session, wanted: ImageFilters, paging: Paging
) -> tuple[Sequence[GroundTruthImage], str | None]:
    """Return a part of the list of photographs."""
    return fetch_page(session, _images(wanted), GroundTruthImage.id, paging)


def _images(wanted: ImageFilters) -> sa.Select[GroundTruthImage]:
    statement = sa.select(GroundTruthImage).where(
        *_visible(wanted.site_ids),
        *_equal(GroundTruthImage.site_id, wanted.site_id),
        *_equal(GroundTruthImage.image_id, wanted.image_id),
        *_equal(GroundTruthImage.file_id, wanted.file_id),
        *_equal(GroundTruthImage.is_complete, wanted.complete),
    )
    if wanted.here is not None:
        is_here = GroundTruthImage.image_id.is_not(None)
        statement = statement.where(is_here if wanted.here else ~is_here)
    return statement


def boxes(
    session: Session, wanted: BoxFilters, paging: Paging
) -> tuple[Sequence[GroundTruthBox], str | None]:
    """Return a part of the list of boxes."""
    statement = (
        sa.select(GroundTruthBox)
        .join(GroundTruthBox.image)
        .options(joinedload(GroundTruthBox.image))
        .where(
            GroundTruthBox.deleted_at.is_(None),
            *_visible(wanted.site_ids),
            *_equal(GroundTruthImage.site_id, wanted.site_id),
            *_equal(GroundTruthImage.image_id, wanted.image_id),
            *_equal(GroundTruthImage.id, wanted.ground_truth_image_id),
            *_equal(GroundTruthImage.file_id, wanted.file_id),
            *_equal(GroundTruthBox.vessel_class, wanted.vessel_class),
        )
    )
    return fetch_page(session, statement, GroundTruthBox.id, paging)


def _equal(
    column: sa.orm.InstrumentedAttribute[Any], value: object
) -> list[sa.ColumnElement[bool]]:
    return [] if value is None else [column == value]


def _visible(site_ids: frozenset[int] | None) -> list[sa.ColumnElement[bool]]:
    """Leave out other sites, and photographs that were deleted and may come back."""
    deleted = sa.select(Image.id).where(Image.deleted_at.is_not(None))
    is_here = sa.or_(GroundTruthImage.image_id.is_(None), GroundTruthImage.image_id.not_in(deleted))
    return [is_here] if site_ids is None else [is_here, GroundTruthImage.site_id.in_(site_ids)]


def boxes_of(session: Session, ground_truth_image_id: int) -> Sequence[GroundTruthBox]:
    """Return the boxes of a photograph."""
    return session.scalars(
        sa.select(GroundTruthBox)
        .where(
            GroundTruthBox.ground_truth_image_id == ground_truth_image_id,
            GroundTruthBox.deleted_at.is_(None),
        )
        .order_by(GroundTruthBox.id)
    ).all()


def count_boxes(session: Session, image_ids: Sequence[int]) -> dict[int, int]:
    """Count the boxes of photographs."""
    statement = (
        sa.select(GroundTruthBox.ground_truth_image_id, sa.func.count())
        .where(
            GroundTruthBox.ground_truth_image_id.in_(image_ids),
            GroundTruthBox.deleted_at.is_(None),
        )
        .group_by(GroundTruthBox.ground_truth_image_id)
    )
    return {image_id: int(count) for image_id, count in session.execute(statement)}


def totals(
    session: Session, column: sa.orm.InstrumentedAttribute[Any], values: Iterable[int]
) -> Mapping[int, tuple[int, int, int, int]]:
    """Count photographs, those here, complete ones and boxes of sites or files."""
    wanted = list(values)
    counts = sa.select(
        column,
        sa.func.count(),
        sa.func.count(GroundTruthImage.image_id),
        sa.func.sum(sa.case((GroundTruthImage.is_complete, 1), else_=0)),
    ).where(column.in_(wanted), *_visible(None))
    boxes = (
        sa.select(column, sa.func.count())
        .select_from(GroundTruthBox)
        .join(GroundTruthBox.image)
        .where(column.in_(wanted), GroundTruthBox.deleted_at.is_(None), *_visible(None))
    )
    counted = session.execute(boxes.group_by(column))
    boxes_of: dict[int, int] = {key: int(count) for key, count in counted}
    return {
        key: (images, here, int(complete), boxes_of.get(key, 0))
        for key, images, here, complete in session.execute(counts.group_by(column))
    }


def all_of(
    session: Session, site_id: int, file_id: int | None
) -> tuple[list[GroundTruthFile], list[GroundTruthImage], list[GroundTruthBox]]:
    """Return all files, photographs and boxes of a site, or of one file of it, in their order."""
    of_file = _equal(GroundTruthImage.file_id, file_id)
    images = session.scalars(
        sa.select(GroundTruthImage)
        .where(GroundTruthImage.site_id == site_id, *of_file, *_visible(None))
        .order_by(GroundTruthImage.id)
    ).all()
    boxes = session.scalars(
        sa.select(GroundTruthBox)
        .join(GroundTruthBox.image)
        .where(
            GroundTruthImage.site_id == site_id,
            GroundTruthBox.deleted_at.is_(None),
            *of_file,
            *_visible(None),
        )
        .order_by(GroundTruthBox.id)
    ).all()
    files = session.scalars(
        sa.select(GroundTruthFile)
        .where(GroundTruthFile.site_id == site_id, *_equal(GroundTruthFile.id, file_id))
        .order_by(GroundTruthFile.id)
    ).all()
    return list(files), list(images), list(boxes)


def first_photograph(session: Session, site_id: int) -> int | None:
    """Return a site's first photograph whose boxes are not complete."""
    complete = sa.exists().where(
        GroundTruthImage.image_id == Image.id, GroundTruthImage.is_complete
    )
    statement = (
        sa.select(Image.id)
        .where(Image.site_id == site_id, Image.deleted_at.is_(None), ~complete)
        .order_by(Image.camera_id, Image.captured_at, Image.id)
        .limit(1)
    )
    found: int | None = session.scalar(statement)
    return found


def next_open(session: Session, photo: Image) -> int | None:
    """Return the next photograph of the camera whose boxes are not complete, by time."""
    complete = sa.exists().where(
        GroundTruthImage.image_id == Image.id, GroundTruthImage.is_complete
    )
    order = (Image.captured_at, Image.id)
    statement = (
        sa.select(Image.id)
        .where(
            Image.camera_id == photo.camera_id,
            sa.tuple_(*order) > sa.tuple_(sa.literal(photo.captured_at), sa.literal(photo.id)),
            Image.deleted_at.is_(None),
            ~complete,
        )
        .order_by(*order)
        .limit(1)
    )
    found: int | None = session.scalar(statement)
    return found


def add_images(session: Session, rows: Sequence[Mapping[str, Any]]) -> list[int]:
    """Add photographs and return their ids in order."""
    statement = sa.insert(GroundTruthImage).returning(
        GroundTruthImage.id, sort_by_parameter_order=True
    )
    return list(session.scalars(statement, list(rows))) if rows else []


def add_boxes(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add many boxes."""
    if rows:
        session.execute(sa.insert(GroundTruthBox), list(rows))


def photographs_named(
    session: Session, site_id: int, names: Iterable[str]
) -> dict[tuple[str, int, int], list[Image]]:
    """Return a site's photographs with some names that nobody drew in yet, by name and size."""
    wanted = sorted(set(names))
    found: dict[tuple[str, int, int], list[Image]] = {}
    drawn = sa.exists().where(GroundTruthImage.image_id == Image.id)
    for start in range(0, len(wanted), _NAMES_AT_ONCE):
        statement = sa.select(Image).where(
            Image.site_id == site_id,
            Image.file_name.in_(wanted[start : start + _NAMES_AT_ONCE]),
            Image.deleted_at.is_(None),
            ~drawn,
        )
        for photo in session.scalars(statement):
            found.setdefault((photo.file_name, photo.width_px, photo.height_px), []).append(photo)
    return found


def absent(session: Session, site_id: int) -> Sequence[GroundTruthImage]:
    """Return the photographs of a site that are not here."""
    return session.scalars(
        sa.select(GroundTruthImage)
        .where(GroundTruthImage.site_id == site_id, GroundTruthImage.image_id.is_(None))
        .order_by(GroundTruthImage.id)
    ).all()


def move_detections(session: Session, before_sha256: str, after_sha256: str) -> None:
    """Give what was detected in an absent photograph to the photograph that came.

    Sets of a detector that has looked at the photograph itself stay where they are.
    """
    there = sa.select(DetectionSet.model_sha256, DetectionSet.settings_sha256).where(
        DetectionSet.image_sha256 == after_sha256
    )
    known = {(model, settings) for model, settings in session.execute(there)}
    moved = sa.select(DetectionSet).where(DetectionSet.image_sha256 == before_sha256)
    for found in session.scalars(moved):
        if (found.model_sha256, found.settings_sha256) not in known:
            found.image_sha256 = after_sha256


def touch(session: Session, image: GroundTruthImage) -> None:
    """Let a photograph's version grow: one of its boxes changed."""
    session.execute(
        sa.update(GroundTruthImage)
        .where(GroundTruthImage.id == image.id)
        .values(version=GroundTruthImage.version + 1)
        .execution_options(synchronize_session=False)
    )
    session.refresh(image)


def mark_deleted(box: GroundTruthBox, *, deleted: bool) -> None:
    """Take a box away, or bring it back."""
    box.deleted_at = now() if deleted else None
