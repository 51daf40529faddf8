"""Boxes by people in COCO's format, read and checked as a whole before anything is stored.

    {"images": [{"id", "file_name", "width", "height"}], "categories": [{"id", "name"}],
     "annotations": [{"id", "image_id", "category_id", "bbox": [x, y, width, height],
                      "area", "iscrowd"}], ...}

Nobody knows what else a tool writes into such a file, and whoever gets it back wants it as it was.
So every entry is kept whole beside what is read from it, and so is the rest of the document. An
error names the entry and the field.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

from app.errors import Invalid
from app.tables.groundtruth import VesselClass

LEFT_OUT = "none"
"""What a category is mapped to whose boxes are no vessels."""
_LARGEST_ID = 2**63 - 1
_LARGEST_SIDE_PX = 100_000
_LONGEST_NAME, _LONGEST_PATH = 255, 1000


@dataclass(frozen=True, slots=True)
class CocoImage:
    """A photograph of a file; `base_name` is its name without folders."""

    entry: Mapping[str, Any]
    coco_id: int
    file_name: str
    base_name: str
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True)
class CocoBox:
    """An annotation of a file; `image` is the place of its photograph in the list of images."""

    entry: Mapping[str, Any]
    coco_id: int | None
    image: int
    category_id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    area_px2: float
    is_crowd: bool


@dataclass(frozen=True, slots=True)
class CocoFile:
    """A whole file; `document` is all of it but images and annotations."""

    document: Mapping[str, Any]
    categories: Mapping[int, str]
    images: Sequence[CocoImage]
    boxes: Sequence[CocoBox]

    @property
    def boxes_of_category(self) -> Mapping[int, int]:
        """How many boxes each category has, in the order of the file's list."""
        counts = Counter(box.category_id for box in self.boxes)
        return {category_id: counts[category_id] for category_id in self.categories}


def read_coco(data: bytes) -> CocoFile:
    """Read a file. Raises Invalid naming what is wrong."""
    parsed = _parsed(data)
    lists = {name: parsed.get(name) for name in ("images", "annotations", "categories")}
    for name, values in lists.items():
        if not isinstance(values, list):
            raise Invalid.field("file", f"wanted is a COCO file: it has no list of `{name}`")
    categories = _categories(parsed["categories"])
    images = [_image(entry, f"images[{i}]") for i, entry in enumerate(parsed["images"])]
    place_of: dict[int, int] = {}
    for index, image in enumerate(images):
        if place_of.setdefault(image.coco_id, index) != index:
            raise Invalid.field(f"images[{index}].id", f"{image.coco_id} is another image's, too")
    boxes = [
        _box(entry, f"annotations[{i}]", images, place_of, categories)
        for i, entry in enumerate(parsed["annotations"])
    ]
    ids = Counter(box.coco_id for box in boxes if box.coco_id is not None)
    twice = next((coco_id for coco_id, count in ids.items() if count > 1), None)
    if twice is not None:
        raise Invalid.field("annotations", f"two of them have the id {twice}")
    rest = {name: v for name, v in parsed.items() if name not in {"images", "annotations"}}
    return CocoFile(rest, categories, images, boxes)


def classes_of(file: CocoFile, said: Mapping[str, str]) -> dict[int, VesselClass | None]:
    """Say which class each category is, None for one that is left out.

    A category with the name of a class is that class, unless `said` (by name or by id) says
    something else. Raises Invalid for categories with boxes that nobody knows.
    """
    unknown = set(said) - {str(i) for i in file.categories} - set(file.categories.values())
    if unknown:
        raise Invalid.field("map", f"the file has no category {min(unknown)!r}")
    answer: dict[int, VesselClass | None] = {}
    missing = []
    for category_id, count in file.boxes_of_category.items():
        name = file.categories[category_id]
        value = said.get(name, said.get(str(category_id), name))
        if value == LEFT_OUT:
            answer[category_id] = None
        elif value in set(VesselClass):
            answer[category_id] = VesselClass(value)
        elif name in said or str(category_id) in said:
            raise Invalid.field("map", f"{value!r} is no class; choose {_choices()}")
        elif count:
            missing.append(f"{name} ({count} boxes)")
    if missing:
        name = missing[0].rpartition(" (")[0]
        raise Invalid.field(
            "map",
            f"say what these categories are: {', '.join(missing)}; such as {name}=ship. "
            f"Choose {_choices()}",
        )
    return answer


def _choices() -> str:
    return f"one of {', '.join(VesselClass)}, or {LEFT_OUT} to leave its boxes out"


def _parsed(data: bytes) -> dict[str, Any]:
    try:
        parsed = json.loads(data)
        # What neither JSON nor every database can hold comes to light when it is written again.
        text = json.dumps(parsed, allow_nan=False, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise Invalid.field("file", f"this is not JSON: {str(error)[:200]}") from error
    if b"\\u0000" in text:
        raise Invalid.field("file", "a text in it holds the character 0; take that out")
    if not isinstance(parsed, dict):
        raise Invalid.field("file", "wanted is an object with images, annotations and categories")
    return parsed


def _categories(entries: Sequence[Any]) -> dict[int, str]:
    names: dict[int, str] = {}
    for index, entry in enumerate(entries):
        where = f"categories[{index}]"
        category_id = _whole(entry, where, "id")
        name = entry.get("name")
        if not isinstance(name, str) or not name:
            raise Invalid.field(f"{where}.name", "name the category")
        if category_id in names or name in names.values():
            raise Invalid.field(where, "another category has the same id or name")
        names[category_id] = name
    return names


def _image(entry: Any, where: str) -> CocoImage:  # noqa: ANN401  whatever is in the file
    coco_id = _whole(entry, where, "id")
    name = entry.get("file_name")
    base_name = name.replace("\\", "/").rpartition("/")[2] if isinstance(name, str) else ""
    if not base_name or len(base_name) > _LONGEST_NAME or len(name) > _LONGEST_PATH:
        raise Invalid.field(
            f"{where}.file_name", f"name the image's file, with at most {_LONGEST_NAME} characters"
        )
    width, height = (_whole(entry, where, side) for side in ("width", "height"))
    for side, value in (("width", width), ("height", height)):
        if not 0 < value <= _LARGEST_SIDE_PX:
            raise Invalid.field(f"{where}.{side}", f"give 1 to {_LARGEST_SIDE_PX} pixels")
    return CocoImage(entry, coco_id, name, base_name, width, height)


def _box(
    entry: Any,  # noqa: ANN401  as above
    where: str,
    images: Sequence[CocoImage],
    place_of: Mapping[int, int],
    categories: Mapping[int, str],
) -> CocoBox:
    image_id, category_id = (_whole(entry, where, name) for name in ("image_id", "category_id"))
    if image_id not in place_of:
        raise Invalid.field(f"{where}.image_id", f"{image_id} is not in the list of images")
    if category_id not in categories:
        raise Invalid.field(f"{where}.category_id", f"{category_id} is not among the categories")
    bbox = entry.get("bbox")
    numbers = [_number(value) for value in bbox] if isinstance(bbox, list) else []
    x, y, width, height = numbers if len(numbers) == 4 else (None,) * 4
    if x is None or y is None or width is None or height is None:
        raise Invalid.field(f"{where}.bbox", "give four finite numbers: x, y, width, height")
    if width <= 0 or height <= 0:
        raise Invalid.field(f"{where}.bbox", "width and height must be positive")
    image = images[place_of[image_id]]
    if x >= image.width_px or y >= image.height_px or x + width <= 0 or y + height <= 0:
        size = f"{image.width_px} x {image.height_px} px"
        raise Invalid.field(f"{where}.bbox", f"lies outside its image of {size}")
    area = _number(entry.get("area", width * height))
    if area is None or area < 0:
        raise Invalid.field(f"{where}.area", "give a number of square pixels from 0 on")
    return CocoBox(
        entry=entry,
        coco_id=_whole(entry, where, "id") if "id" in entry else None,
        image=place_of[image_id],
        category_id=category_id,
        x1_px=x,
        y1_px=y,
        x2_px=x + width,
        y2_px=y + height,
        area_px2=area,
        is_crowd=_flag(entry.get("iscrowd", 0), f"{where}.iscrowd"),
    )


def _flag(value: object, where: str) -> bool:
    if value in (0, 1):
        return bool(value)
    raise Invalid.field(where, "give 0 or 1")


def _number(value: object) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool) or abs(value) > 1e12:
        return None
    return float(value) if isfinite(value) else None


def _whole(entry: Any, where: str, field: str) -> int:  # noqa: ANN401  as above
    if not isinstance(entry, dict):
        raise Invalid.field(where, "wanted is an object")
    value = entry.get(field)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _LARGEST_ID:
        raise Invalid.field(f"{where}.{field}", "give a whole number from 0 on")
    return value
