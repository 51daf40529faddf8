"""Taking a COCO file in: looked at first, then stored as a whole or not at all."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.db import now
from app.errors import Conflict
from app.groundtruth import repository, service
from app.groundtruth.coco_file import LEFT_OUT, CocoFile, classes_of
from app.tables.groundtruth import GroundTruthFile, VesselClass


@dataclass(frozen=True, slots=True)
class ImportChoices:
    """What a person says of a file: its name, what its categories are, what its images are.

    `complete`: every vessel of its images has a box. `link`: a photograph here that has the name
    and size of one of its images is that photograph.
    """

    file_name: str
    said: Mapping[str, str]
    complete: bool = True
    link: bool = True


@dataclass(frozen=True, slots=True)
class CategoryFound:
    """A category of a file, its boxes, and the class its name is (None: a person has to say)."""

    category_id: int
    name: str
    boxes: int
    proposed: str | None


@dataclass(frozen=True, slots=True)
class Looked:
    """What is in a file, and how many of its photographs are here."""

    images: int
    boxes: int
    images_without_boxes: int
    photographs_here: int
    categories: list[CategoryFound]
    is_known: bool


@dataclass(frozen=True, slots=True)
class Imported:
    """What an import brought."""

    file: GroundTruthFile
    created: bool
    images: int
    boxes: int
    linked: int
    left_out: int


def look_at(session: Session, site_id: int, data: bytes, file: CocoFile) -> Looked:
    """Tell what an import of a file would bring."""
    keys = {(one.base_name, one.width_px, one.height_px) for one in file.images}
    here = repository.photographs_named(session, site_id, (name for name, _, _ in keys))
    return Looked(
        images=len(file.images),
        boxes=len(file.boxes),
        images_without_boxes=len(file.images) - len({box.image for box in file.boxes}),
        photographs_here=sum(len(here.get(key, ())) == 1 for key in keys),
        categories=[
            CategoryFound(
                category_id,
                file.categories[category_id],
                count,
                file.categories[category_id]
                if file.categories[category_id] in set(VesselClass)
                else None,
            )
            for category_id, count in file.boxes_of_category.items()
        ],
        is_known=repository.file_of_content(session, site_id, sha256_of(data)) is not None,
    )


def sha256_of(data: bytes) -> str:
    """Return the key by which a file is known again."""
    return hashlib.sha256(data).hexdigest()


def store(
    session: Session,
    site_id: int,
    sha256: str,
    file: CocoFile,
    choices: ImportChoices,
    user_id: int | None,
) -> Imported:
    """Store a file, unless it is there already with the same classes.

    Raises Invalid for categories that nobody knows, Conflict for other classes than before.
    """
    classes = classes_of(file, choices.said)
    told = {str(category): value or LEFT_OUT for category, value in classes.items()}
    known = repository.file_of_content(session, site_id, sha256)
    if known is not None:
        if known.class_of_category != told:
            raise Conflict(
                f"this file is here already (no. {known.id}) with other classes; remove it first"
            )
        there = service.totals_by_file(session, [known.id]).get(known.id, service.Totals())
        return Imported(
            known, created=False, images=there.images, boxes=there.boxes, linked=0, left_out=0
        )
    row = GroundTruthFile(
        site_id=site_id,
        sha256=sha256,
        file_name=choices.file_name[:255],
        document=dict(file.document),
        class_of_category=told,
        created_by_id=user_id,
    )
    session.add(row)
    session.flush()
    boxes = _store_boxes(session, row, file, classes, choices, user_id)
    linked = service.link(session, site_id) if choices.link else 0
    return Imported(
        row,
        created=True,
        images=len(file.images),
        boxes=boxes,
        linked=linked,
        left_out=len(file.boxes) - boxes,
    )


def _store_boxes(
    session: Session,
    row: GroundTruthFile,
    file: CocoFile,
    classes: Mapping[int, VesselClass | None],
    choices: ImportChoices,
    user_id: int | None,
) -> int:
    moment = now()
    image_ids = repository.add_images(
        session,
        [
            {
                "site_id": row.site_id,
                "file_id": row.id,
                "file_name": one.file_name,
                "base_name": one.base_name,
                "width_px": one.width_px,
                "height_px": one.height_px,
                "content_sha256": service.stand_in_sha256(
                    row.site_id, one.base_name, one.width_px, one.height_px
                ),
                "coco_id": one.coco_id,
                "entry": dict(one.entry),
                "is_complete": choices.complete,
                "completed_at": moment if choices.complete else None,
                "completed_by_id": user_id if choices.complete else None,
            }
            for one in file.images
        ],
    )
    rows = [
        {
            "ground_truth_image_id": image_ids[box.image],
            "x1_px": box.x1_px,
            "y1_px": box.y1_px,
            "x2_px": box.x2_px,
            "y2_px": box.y2_px,
            "area_px2": box.area_px2,
            "is_crowd": box.is_crowd,
            "vessel_class": vessel_class,
            "coco_id": box.coco_id,
            "entry": dict(box.entry),
            "user_id": user_id,
        }
        for box in file.boxes
        if (vessel_class := classes[box.category_id]) is not None
    ]
    repository.add_boxes(session, rows)
    return len(rows)
