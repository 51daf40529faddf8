"""Storing imported detections: a model that stands for their source, and a set for each image.

The sets have the key of any detection (image, model, settings), so a run uses them as if a detector
here had found them. All entries are matched with images first; then all is stored, or nothing.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.db import Database
from app.detectors import repository
from app.detectors.coco_results import CocoResults, ImageKey, ResultBox, read_results
from app.detectors.service import (
    IMPORTED_FAMILY,
    IMPORTED_SETTINGS_SHA256,
    checked_name,
    get_model,
)
from app.errors import Conflict, Invalid
from app.tables.detection import Model, ModelStatus
from app.tables.groundtruth import GroundTruthImage
from app.tables.imagery import Image

_LARGEST_CLASS_ID = 2**31 - 1


@dataclass(frozen=True, slots=True)
class Photograph:
    """A photograph that detections can be of; an absent one is known by ground truth only."""

    id: int
    sha256: str
    site_id: int
    camera_id: int | None
    width_px: int
    height_px: int

    @classmethod
    def of(cls, image: Image) -> "Photograph":
        """Take the columns of one that is here."""
        return cls(
            image.id, image.sha256, image.site_id, image.camera_id, image.width_px, image.height_px
        )

    @classmethod
    def of_truth(cls, image: GroundTruthImage) -> "Photograph":
        """Take the columns of one that people drew boxes in."""
        return cls(
            image.id, image.content_sha256, image.site_id, None, image.width_px, image.height_px
        )


@dataclass(frozen=True, slots=True)
class Resolved:
    """A results file whose images were all found, waiting to be stored."""

    sha256: str
    size_bytes: int
    name: str
    boxes_by_image: dict[str, list[dict[str, Any]]]
    site_ids: frozenset[int]
    ignored: int
    lists_images: bool
    without_area: int

    @property
    def detections(self) -> int:
        """How many boxes it brings."""
        return sum(map(len, self.boxes_by_image.values()))


@dataclass(frozen=True, slots=True)
class ImportedDetections:
    """What an import brought, and whether it was new."""

    model: Model
    created: bool
    images: int
    detections: int
    ignored: int
    without_area: int

    @property
    def notes(self) -> list[str]:
        """What somebody may not expect of the file, in sentences."""
        told = []
        if not self.images:
            told.append(
                "The file says that nothing was found, and in no image. Give the list of images "
                "to say where nothing was found."
            )
        elif not self.detections:
            told.append("The file says that nothing was found in any of these images.")
        if self.without_area:
            have = "box has" if self.without_area == 1 else "boxes have"
            told.append(
                f"{self.without_area:,} {have} no width or no height: a false detection to "
                "pycocotools and here, which runs pass over."
            )
        return told


def import_coco_detections(
    database: Database,
    data: bytes,
    *,
    name: str,
    camera_id: int | None = None,
    images: bytes | None = None,
    categories: Mapping[int, int] | None = None,
    user_id: int | None = None,
) -> ImportedDetections:
    """Import detections in COCO's results format as the boxes of a model of family `imported`.

    See `coco_results` for the format. The same file again changes nothing. Raises Invalid naming
    entry and field, Conflict for a name that is taken.
    """
    with database.reading() as session:
        found = resolve(
            session, data, name=name, camera_id=camera_id, images=images, categories=categories
        )
    with database.writing() as session:
        return store(session, found, user_id=user_id)


def resolve(
    session: Session,
    data: bytes,
    *,
    name: str,
    camera_id: int | None = None,
    images: bytes | None = None,
    categories: Mapping[int, int] | None = None,
    site_ids: frozenset[int] | None = None,
) -> Resolved:
    """Read a results file and find its images, of the sites `site_ids` (None: of all)."""
    name = checked_name(name)
    if categories is not None and not all(
        0 <= class_id <= _LARGEST_CLASS_ID for class_id in categories.values()
    ):
        raise Invalid.field("categories", "class ids must be whole numbers from 0 on")
    results = read_results(data, images, categories)
    found = _images_of(session, results, camera_id, site_ids)
    boxes: dict[str, list[dict[str, Any]]] = {}
    ids_of: dict[str, int] = {}
    for image in found.values():
        if ids_of.setdefault(image.sha256, image.id) != image.id:
            raise Invalid.field(
                "file",
                f"images {ids_of[image.sha256]} and {image.id} are the same bytes, which have one "
                "set of boxes; name only one of them, or the camera",
            )
        boxes[image.sha256] = []
    for box in results.boxes:
        image = found[box.image]
        boxes[image.sha256].append(_columns(box, image))
    return Resolved(
        sha256=_content_sha256(data, images, categories),
        size_bytes=len(data) + len(images or b""),
        name=name,
        boxes_by_image=boxes,
        site_ids=frozenset(image.site_id for image in found.values()),
        ignored=results.ignored,
        lists_images=results.lists_images,
        without_area=sum(not box.has_area for box in results.boxes),
    )


def store(session: Session, found: Resolved, *, user_id: int | None) -> ImportedDetections:
    """Store what was resolved, unless it is there already. Raises Conflict for a taken name."""
    other = repository.model_of_content(session, found.sha256)
    if other is None:
        model_id = repository.add_model(
            session,
            {
                "name": found.name,
                "family": IMPORTED_FAMILY,
                "sha256": found.sha256,
                "size_bytes": found.size_bytes,
                "status": ModelStatus.READY,
                "signature": {
                    "images": len(found.boxes_by_image),
                    "boxes": found.detections,
                    "lists_images": found.lists_images,
                    "without_area": found.without_area,
                },
                "created_by_id": user_id,
            },
        )
        if model_id is None:
            other = repository.model_of_name(session, found.name)
        else:
            repository.add_detections(
                session, found.sha256, IMPORTED_SETTINGS_SHA256, found.boxes_by_image
            )
            return _outcome(get_model(session, model_id), found, created=True)
    if other is None or other.sha256 != found.sha256:
        raise Conflict(f"another model has the name {found.name!r} already; choose another name")
    return _outcome(other, found, created=False)


def _outcome(model: Model, found: Resolved, *, created: bool) -> ImportedDetections:
    return ImportedDetections(
        model,
        created,
        len(found.boxes_by_image),
        found.detections,
        found.ignored,
        found.without_area,
    )


def _images_of(
    session: Session,
    results: CocoResults,
    camera_id: int | None,
    site_ids: frozenset[int] | None,
) -> dict[ImageKey, Photograph]:
    ids = [key for key in results.images if isinstance(key, int)]
    names = [key for key in results.images if isinstance(key, str)]
    candidates_of = _by_id(session, ids) | _by_name(session, names, camera_id)
    entry_of = {box.image: box.index for box in reversed(results.boxes)}
    found: dict[ImageKey, Photograph] = {}
    for key in results.images:
        candidates = [
            image
            for image in candidates_of.get(key, ())
            if (camera_id is None or image.camera_id == camera_id)
            and (site_ids is None or image.site_id in site_ids)
        ]
        if len(candidates) != 1:
            field = f"[{entry_of[key]}].image_id" if key in entry_of else "images"
            raise Invalid.field(field, _which(key, len(candidates), camera_id))
        found[key] = candidates[0]
    return found


def _by_id(session: Session, ids: Sequence[int]) -> dict[ImageKey, list[Photograph]]:
    """Find images by our ids; where some are not ours, by the ids of a ground truth file."""
    ours = repository.images_by_id(session, ids)
    if len(ours) == len(set(ids)):
        return {key: [Photograph.of(image)] for key, image in ours.items()}
    files = repository.images_of_ground_truth(session, ids)
    if len(files) != 1:
        return {key: [Photograph.of(image)] for key, image in ours.items()}
    return {key: [Photograph.of_truth(image)] for key, image in files[0].items()}


def _by_name(
    session: Session, names: Sequence[str], camera_id: int | None
) -> dict[ImageKey, list[Photograph]]:
    """Find images by name; one that is absent only where none with the name is here."""
    here = repository.images_by_name(session, names, camera_id)
    found: dict[ImageKey, list[Photograph]] = {
        name: [Photograph.of(image) for image in images] for name, images in here.items()
    }
    others = [name for name in names if name not in here]
    for name, absent in repository.absent_by_name(session, others).items():
        found[name] = [Photograph.of_truth(image) for image in absent]
    return found


def _which(key: ImageKey, count: int, camera_id: int | None) -> str:
    where = "" if camera_id is None else f" of camera {camera_id}"
    if count == 0 and isinstance(key, str) and key.isdecimal():
        return f"there is no file {key!r}{where}; if that is an id, give it without quotes"
    if count == 0:
        return (
            f"there is no image {key!r}{where}; "
            "import the images first, or ground truth that names it"
        )
    advice = "give the camera" if camera_id is None else "use image ids"
    return f"{count} images{where} have the name {key!r}; {advice}"


def _columns(box: ResultBox, image: Photograph) -> dict[str, Any]:
    is_beside = box.x2_px <= 0 or box.x1_px >= image.width_px
    if box.has_area and (is_beside or box.y2_px <= 0 or box.y1_px >= image.height_px):
        raise Invalid.field(
            f"[{box.index}].bbox",
            f"lies outside its image of {image.width_px} x {image.height_px} px",
        )
    return {
        "x1_px": box.x1_px,
        "y1_px": box.y1_px,
        "x2_px": box.x2_px,
        "y2_px": box.y2_px,
        "score": box.score,
        "class_id": box.class_id,
    }


def _content_sha256(data: bytes, images: bytes | None, categories: Mapping[int, int] | None) -> str:
    """Return the file's own hash; what was given beside it counts only where it was given."""
    digest = hashlib.sha256(data)
    if images is not None:
        digest.update(b"\0images\0" + images)
    if categories is not None:
        digest.update(b"\0categories\0" + json.dumps(sorted(categories.items())).encode())
    return digest.hexdigest()
