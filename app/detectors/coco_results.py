"""Detections of any other detector, read from COCO's results format.

    [{"image_id": 7, "category_id": 9, "bbox": [x, y, width, height], "score": 0.83}, ...]

An object with `annotations` (the same entries) and, if need be, `images` and `categories` is taken
too. `image_id` is a file name, or an id: of the `images` list where there is one, else our own.
Everything is checked before anything is stored; an error names the entry and the field.

Which categories are vessels? COCO's official list has boat at 9, detectors that number its 80
classes from zero have it at 8, detectors of vessels alone use 0 or 1. So, in this order: what the
caller says; the names in `categories`; category 9; a file's only category, if it is 0, 1 or 8.
Whatever else is in the file is ignored and counted.

A box without width or height (a detector's box cut at the image's border) is kept, because
pycocotools counts it as a false detection; what matches vessels passes it over.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import PurePosixPath
from typing import Any

from app.domain.detection import COCO_BOAT
from app.errors import Invalid

COCO_BOAT_CATEGORY = 9
_ONLY_CATEGORIES = frozenset({0, 1, COCO_BOAT})
_VESSEL_NAMES = frozenset({"boat", "ship", "vessel", "watercraft"})
_LARGEST_ID = 2**63 - 1
_LARGEST_PX = 1e9
_ROUNDING = 1e-6  # a softmax in single precision may end beyond 1

ImageKey = int | str
"""An image by our id or by its file name."""


@dataclass(frozen=True, slots=True)
class ResultBox:
    """One entry: its index in the file, its image and its box, px from the image's edge."""

    index: int
    image: ImageKey
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    score: float
    class_id: int

    @property
    def has_area(self) -> bool:
        """Whether it has a width and a height."""
        return self.x1_px < self.x2_px and self.y1_px < self.y2_px


@dataclass(frozen=True, slots=True)
class CocoResults:
    """The vessels of a file, all images it speaks of, and how many boxes were no vessels.

    `lists_images`: images without any box are among them, so that none is missing by accident.
    """

    boxes: list[ResultBox]
    images: list[ImageKey]
    ignored: int
    lists_images: bool


def read_results(
    data: bytes, images: bytes | None = None, categories: Mapping[int, int] | None = None
) -> CocoResults:
    """Read a results file; `images` is a COCO file with an `images` list, or the list itself.

    `categories` maps the file's category ids to our class ids. Raises Invalid.
    """
    parsed = _json(data, "file")
    entries, own_images, named_categories = parsed, None, None
    if isinstance(parsed, dict):
        entries = parsed.get("annotations")
        own_images, named_categories = parsed.get("images"), parsed.get("categories")
    if not isinstance(entries, list):
        raise Invalid.field("file", "wanted is a list of results, or an object with `annotations`")
    if images is not None:
        given = _json(images, "images")
        own_images = given.get("images") if isinstance(given, dict) else given
        if not isinstance(own_images, list):
            raise Invalid.field("images", "wanted is a list, or an object with `images`")
    names = None if own_images is None else _file_names(own_images)
    categories = categories or _vessel_categories(entries, named_categories)
    boxes, ignored = [], 0
    spoken_of: dict[ImageKey, None] = dict.fromkeys((names or {}).values())
    for index, entry in enumerate(entries):
        category_id = _whole(entry, index, "category_id")
        image = _image(entry, index, names)
        spoken_of[image] = None
        if category_id in categories:
            boxes.append(_box(entry, index, image, categories[category_id]))
        else:
            ignored += 1
    return CocoResults(boxes, list(spoken_of), ignored, names is not None)


def _json(data: bytes, field: str) -> Any:  # noqa: ANN401  whatever is in the file
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise Invalid.field(field, f"this is not JSON: {str(error)[:200]}") from error


def _file_names(images: Sequence[Any]) -> dict[int, str]:
    names = {}
    for index, image in enumerate(images):
        name = image.get("file_name") if isinstance(image, dict) else None
        if not isinstance(name, str) or not name:
            raise Invalid.field(f"images[{index}].file_name", "name the image's file")
        image_id = _whole(image, index, "id", of="images")
        if image_id in names:
            raise Invalid.field(f"images[{index}].id", f"{image_id} stands for another image too")
        names[image_id] = PurePosixPath(name).name
    return names


def _vessel_categories(entries: Sequence[Any], named: object) -> dict[int, int]:
    if isinstance(named, list) and named:
        vessels = {
            _whole(category, index, "id", of="categories"): COCO_BOAT
            for index, category in enumerate(named)
            if isinstance(category, dict) and str(category.get("name")).lower() in _VESSEL_NAMES
        }
        if vessels:
            return vessels
    values = (entry.get("category_id") for entry in entries if isinstance(entry, dict))
    used = {int(value) for value in values if isinstance(value, int | float) and isfinite(value)}
    if COCO_BOAT_CATEGORY in used or not used:
        return {COCO_BOAT_CATEGORY: COCO_BOAT}
    if len(used) == 1 and used <= _ONLY_CATEGORIES:
        return {used.pop(): COCO_BOAT}
    raise Invalid.field(
        "categories",
        f"the file has the categories {sorted(used)[:20]}; say which are vessels, "
        f'such as {{"{min(used)}": {COCO_BOAT}}}',
    )


def _image(entry: Mapping[str, Any], index: int, names: Mapping[int, str] | None) -> ImageKey:
    value = entry.get("image_id")
    if isinstance(value, str) and value:
        return PurePosixPath(value).name
    image_id = _whole(entry, index, "image_id")
    if names is None:
        return image_id
    if image_id not in names:
        raise Invalid.field(f"[{index}].image_id", f"{image_id} is not in the list of images")
    return names[image_id]


def _box(entry: Mapping[str, Any], index: int, image: ImageKey, class_id: int) -> ResultBox:
    bbox = entry.get("bbox")
    numbers = [_number(value) for value in bbox] if isinstance(bbox, list) else []
    x_px, y_px, width_px, height_px = numbers if len(numbers) == 4 else (None,) * 4
    if x_px is None or y_px is None or width_px is None or height_px is None:
        raise Invalid.field(f"[{index}].bbox", "give four finite numbers: x, y, width, height")
    if width_px < 0 or height_px < 0:
        raise Invalid.field(
            f"[{index}].bbox",
            "width and height must not be negative; a box is x, y, width, height, not two corners",
        )
    score = _number(entry.get("score"))
    if score is None or not -_ROUNDING <= score <= 1 + _ROUNDING:
        raise Invalid.field(f"[{index}].score", "give a number between 0 and 1")
    score = min(max(score, 0.0), 1.0)
    return ResultBox(index, image, x_px, y_px, x_px + width_px, y_px + height_px, score, class_id)


def _number(value: object) -> float | None:
    """Return a finite number of a size that pixels may have, else None."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    return float(value) if abs(value) < _LARGEST_PX else None


def _whole(entry: Any, index: int, field: str, of: str = "") -> int:  # noqa: ANN401  as above
    if not isinstance(entry, dict):
        raise Invalid.field(f"{of}[{index}]", "wanted is an object")
    value = entry.get(field)
    if isinstance(value, float) and value.is_integer():
        value = int(value)  # tables with gaps make floats of ids
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _LARGEST_ID:
        quoted = ", without quotes" if isinstance(value, str) else ""
        raise Invalid.field(f"{of}[{index}].{field}", f"give a whole number from 0 on{quoted}")
    return value
