"""Boxes written as a COCO file: what came in goes out as it was, what is new or changed beside it.

Entries that were imported are written as they came; only a box that was moved, or given another
class, gets new numbers. Ids are kept unless two files use the same one. A category keeps the file's
id and name as long as it still stands for the box's class.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from app.tables.groundtruth import GroundTruthBox, GroundTruthFile, GroundTruthImage, VesselClass


class _Ids:
    """Hands out ids: the wanted one while it is free, else the next above all that are known."""

    def __init__(self, wanted: Iterable[int | None]) -> None:
        self._next = max((one for one in wanted if one is not None), default=0) + 1
        self._used: set[int] = set()

    def give(self, wanted: int | None) -> int:
        if wanted is None or wanted in self._used:
            wanted, self._next = self._next, self._next + 1
        self._used.add(wanted)
        return wanted


class _Categories:
    """The categories of the document, and which of them stands for a box."""

    def __init__(self, files: Sequence[GroundTruthFile]) -> None:
        self.entries: list[dict[str, Any]] = []
        self._ids: dict[str, int] = {}
        self._files = {file.id: file for file in files}
        self._names = {
            file.id: {entry["id"]: entry["name"] for entry in file.document["categories"]}
            for file in files
        }
        for file in files:
            for entry in file.document["categories"]:
                self._add(entry["name"], entry)
        if not files:
            for vessel_class in VesselClass:
                self._id_of(vessel_class)

    def of(self, box: GroundTruthBox, file_id: int | None) -> int:
        """Return the id of a box's category."""
        if box.entry is not None and file_id is not None:
            category_id = box.entry["category_id"]
            if self._files[file_id].class_of_category.get(str(category_id)) == box.vessel_class:
                return self._id_of(self._names[file_id][category_id])
        return self._id_of(box.vessel_class)

    def _id_of(self, name: str) -> int:
        if name not in self._ids:
            self._add(str(name), {"id": 0, "name": str(name)})
        return self._ids[name]

    def _add(self, name: str, entry: Mapping[str, Any]) -> None:
        if name in self._ids:
            return
        used = set(self._ids.values())
        wanted = entry["id"]
        self._ids[name] = wanted if wanted not in used else max(used) + 1
        self.entries.append({**entry, "id": self._ids[name]})


def coco_document(
    files: Sequence[GroundTruthFile],
    images: Sequence[GroundTruthImage],
    boxes: Sequence[GroundTruthBox],
) -> dict[str, Any]:
    """Return the COCO file of some images and their boxes, in the order given."""
    categories = _Categories(files)
    image_ids = _Ids(image.coco_id for image in images)
    number_of = {image.id: image_ids.give(image.coco_id) for image in images}
    file_of = {image.id: image.file_id for image in images}
    box_ids = _Ids(box.coco_id for box in boxes)
    annotations = [
        _annotation(box, number_of, categories.of(box, file_of[box.ground_truth_image_id]), box_ids)
        for box in boxes
    ]
    rest = dict(files[0].document) if files else {"info": {"description": "Quaymark ground truth"}}
    return {
        **rest,
        "images": [_image(image, number_of[image.id]) for image in images],
        "categories": categories.entries,
        "annotations": annotations,
    }


def _image(image: GroundTruthImage, number: int) -> dict[str, Any]:
    if image.entry is not None:
        return {**image.entry, "id": number}
    return {
        "id": number,
        "file_name": image.file_name,
        "width": image.width_px,
        "height": image.height_px,
    }


def _annotation(
    box: GroundTruthBox, number_of: Mapping[int, int], category_id: int, ids: _Ids
) -> dict[str, Any]:
    entry = box.entry
    placed = {"image_id": number_of[box.ground_truth_image_id], "category_id": category_id}
    if entry is not None and "id" not in entry:
        kept = {**entry, **placed}
    elif entry is not None:
        kept = {**entry, **placed, "id": ids.give(box.coco_id)}
    else:
        kept = {"id": ids.give(None), **placed, "segmentation": [], "iscrowd": int(box.is_crowd)}
    if entry is None or not _stands_where_it_came(box, entry["bbox"]):
        width, height = box.x2_px - box.x1_px, box.y2_px - box.y1_px
        kept["bbox"] = [box.x1_px, box.y1_px, width, height]
        kept["area"] = box.area_px2
    return kept


def _stands_where_it_came(box: GroundTruthBox, bbox: Sequence[float]) -> bool:
    x, y, width, height = bbox
    came = (float(x), float(y), float(x) + float(width), float(y) + float(height))
    return came == (box.x1_px, box.y1_px, box.x2_px, box.y2_px)
