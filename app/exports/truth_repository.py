"""SQL of the 2D boxes that people drew in exported photographs.

A box that came with a file and was not changed goes out with that file's numbers. Of the file's
other fields none is taken over: nobody knows what they tell.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.exports.id_lists import among
from app.exports.writers.records import BoxRecord
from app.published_boxes import PUBLISHED_CATEGORIES
from app.tables.groundtruth import GroundTruthBox, GroundTruthFile, GroundTruthImage

_IDS = {name: category_id for category_id, name in PUBLISHED_CATEGORIES.items()}


def boxes_drawn(session: Session, image_ids: Sequence[int]) -> Mapping[int, list[BoxRecord]]:
    """Return the boxes of some photographs, by photograph; none for those nobody drew in."""
    images = {
        image.id: image
        for image in session.scalars(
            sa.select(GroundTruthImage)
            .where(among(GroundTruthImage.__table__.c.image_id, image_ids))
            .order_by(GroundTruthImage.id)
        )
    }
    found: dict[int, list[BoxRecord]] = {
        image.image_id: [] for image in images.values() if image.image_id is not None
    }
    boxes = session.scalars(
        sa.select(GroundTruthBox)
        .where(
            among(GroundTruthBox.__table__.c.ground_truth_image_id, sorted(images)),
            GroundTruthBox.deleted_at.is_(None),
        )
        .order_by(GroundTruthBox.id)
    )
    for box in boxes:
        image = images[box.ground_truth_image_id]
        if image.image_id is not None:
            found[image.image_id].append(_record(box, image, _file(session, image.file_id)))
    return found


def _file(session: Session, file_id: int | None) -> GroundTruthFile | None:
    return None if file_id is None else session.get(GroundTruthFile, file_id)


def _record(
    box: GroundTruthBox, image: GroundTruthImage, file: GroundTruthFile | None
) -> BoxRecord:
    entry = box.entry or {}
    bbox = [box.x1_px, box.y1_px, box.x2_px - box.x1_px, box.y2_px - box.y1_px]
    came: list[float] = entry.get("bbox") or bbox
    if [came[0], came[1], came[0] + came[2], came[1] + came[3]] == [
        *(box.x1_px, box.y1_px, box.x2_px, box.y2_px)
    ]:
        bbox = came
    return BoxRecord(
        id=box.id if box.coco_id is None else box.coco_id,
        image_id=image.id if image.coco_id is None else image.coco_id,
        category_id=_category(box, entry, file),
        bbox_px=bbox,
        area_px2=box.area_px2,
        is_crowd=box.is_crowd,
        is_ignored=entry.get("ignore") == 1,
    )


def _category(box: GroundTruthBox, entry: Mapping[str, Any], file: GroundTruthFile | None) -> int:
    """Return the published number of a box's class, or of the category it came with."""
    came = entry.get("category_id")
    if file is not None and file.class_of_category.get(str(came)) == box.vessel_class:
        names = {each["id"]: each["name"] for each in file.document["categories"]}
        if names.get(came) in _IDS:
            return _IDS[names[came]]
    return _IDS[box.vessel_class]
