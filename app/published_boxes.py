"""The 2D boxes that labels of BONK-pose carry (`2d_annotation_gt`), gathered into one COCO file.

Each label holds the annotations of its photograph as the authors' COCO file has them: their ids,
that file's id of the photograph, and categories by number alone.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.errors import Invalid

PUBLISHED_CATEGORIES = {
    0: "ship",
    1: "ship_leaving_frame",
    2: "ship_moored",
    3: "ship_partial",
    4: "subvessel",
    5: "boat",
}
SAID = {"boat": "ship"}  # the class of ours that a category of theirs is, where names differ


@dataclass(frozen=True, slots=True)
class Annotated:
    """A photograph's file name, and the annotations of its label."""

    file_name: str
    annotations: Sequence[Mapping[str, Any]]


def gathered(photographs: Sequence[Annotated], width_px: int, height_px: int) -> bytes:
    """Return one COCO file of all photographs.

    Ids stay what they are published as, unless two photographs or boxes have the same.
    """
    image_ids = _ids([_image_id(one) for one in photographs])
    box_ids = _ids([box.get("id") for one in photographs for box in one.annotations])
    images = [
        {"id": number, "file_name": one.file_name, "width": width_px, "height": height_px}
        for number, one in zip(image_ids, photographs, strict=True)
    ]
    owners = [
        number for number, one in zip(image_ids, photographs, strict=True) for _ in one.annotations
    ]
    boxes = [box for one in photographs for box in one.annotations]
    annotations = [
        {**box, "id": box_id, "image_id": image_id}
        for box, box_id, image_id in zip(boxes, box_ids, owners, strict=True)
    ]
    categories = [{"id": number, "name": name} for number, name in PUBLISHED_CATEGORIES.items()]
    return json.dumps(
        {"images": images, "annotations": annotations, "categories": categories}
    ).encode()


def refuse_unusable(label: str, photograph: Annotated, width_px: int, height_px: int) -> None:
    """Raise Invalid naming a label's entry that is no box of its photograph."""
    from app.groundtruth.coco_file import read_coco  # noqa: PLC0415 - only where data are imported

    try:
        read_coco(gathered([photograph], width_px, height_px))
    except Invalid as error:
        raise Invalid(f"{label}: 2d_annotation_gt: {error.detail}") from error


def _image_id(photograph: Annotated) -> object:
    ids = {json.dumps(box.get("image_id")): box.get("image_id") for box in photograph.annotations}
    return next(iter(ids.values())) if len(ids) == 1 else None


def _ids(published: Sequence[object]) -> list[int]:
    whole = [one for one in published if isinstance(one, int) and not isinstance(one, bool)]
    if len(whole) == len(published) == len(set(whole)) and min(whole, default=0) >= 0:
        return whole
    return list(range(1, len(published) + 1))
