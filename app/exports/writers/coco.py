"""COCO detection format with the 6D pose beside each box.

An annotation's `bbox` is the detection's box in px, its `segmentation` the silhouette of the
projected 3D box; the pose stands in the fields that BOP made common: `cam_R_m2c` (rotation of the
vessel axes in the camera frame, row by row) and `cam_t_m2c` (centroid, millimetres). Ids begin at 1
and are counted anew in every file; the installation's own ids stay beside them.
"""

from collections.abc import Iterator, Sequence
from itertools import islice

from app.exports.writers.json_bytes import json_bytes, moment_text, sorted_json
from app.exports.writers.records import (
    ImageRecord,
    PoseRecord,
    ReviewRecord,
    Source,
    refuse_what_is_no_number,
)
from app.exports.writers.silhouettes import silhouettes

CATEGORY = {"id": 1, "name": "vessel", "supercategory": "vessel"}
MM_PER_M = 1000.0
ROWS_AT_ONCE = 500
UNITS = "px, (0, 0) is the centre of the first pixel; cam_t_m2c in mm; dims_m in m; degrees"


def write(source: Source, *, folder: str = "") -> Iterator[bytes]:
    """Give the file in chunks, one line an image and an annotation; memory stays small.

    `folder` is where an archive keeps its photographs; without one they go by their own names.
    """
    yield b'{"info":' + json_bytes(
        {"description": "Vessel poses, made by Quaymark from photographs and AIS", "units": UNITS}
    )
    yield b',\n"categories":' + json_bytes([CATEGORY])
    yield b',\n"images":[\n'
    lead = b""
    images = source.images()
    while some := list(islice(images, ROWS_AT_ONCE)):
        yield lead + b",\n".join(json_bytes(_image(image, folder)) for image in some)
        lead = b",\n"
    yield b'\n],\n"annotations":[\n'
    yield from source.lines(annotations)
    yield b'\n],\n"manifest":' + sorted_json(source.manifest()) + b"}\n"


def annotations(first: int, poses: Sequence[PoseRecord]) -> bytes:
    """Return a line of each pose, with commas between them and before all but the file's first."""
    lead = b",\n" if first else b""
    numbered = enumerate(zip(poses, silhouettes(poses), strict=True), start=first + 1)
    return lead + b",\n".join(
        json_bytes(_annotation(number, pose, outline)) for number, (pose, outline) in numbered
    )


def _image(image: ImageRecord, folder: str) -> dict[str, object]:
    return {
        "id": image.number,
        "file_name": f"{folder}{image.sha256}{image.suffix}" if folder else image.file_name,
        "width": image.width_px,
        "height": image.height_px,
        "date_captured": moment_text(image.captured_at),
        "quaymark_image_id": image.id,
        "sha256": image.sha256,
    }


def _annotation(
    number: int, pose: PoseRecord, silhouette: tuple[list[float], str]
) -> dict[str, object]:
    refuse_what_is_no_number(pose)
    x1, y1, x2, y2 = pose.box_px
    x, y, z = pose.centroid_in_cam_m
    (a, b, c), (d, e, f), (g, h, i) = pose.rotation_cam_from_vessel
    outline, kind = silhouette
    grade, reasons, guideline_version = _verdict(pose.review)
    return {
        "id": number,
        "image_id": pose.image.number,
        "category_id": 1,
        "bbox": [x1, y1, x2 - x1, y2 - y1],
        "area": (x2 - x1) * (y2 - y1),
        "iscrowd": 0,
        "segmentation": [outline],
        "silhouette": kind,
        "score": pose.score,
        "cam_R_m2c": [a, b, c, d, e, f, g, h, i],
        "cam_t_m2c": [x * MM_PER_M, y * MM_PER_M, z * MM_PER_M],
        "dims_m": [pose.length_m, pose.width_m, pose.height_m],
        "corners_2d": pose.corners_in_image_px,
        "vessel": pose.vessel,
        "heading_deg": pose.heading_deg,
        "heading_source": pose.heading_source,
        "report_age_s": pose.report_age_s,
        "matching_cost": pose.cost,
        "position_covariance_in_enu_m2": pose.position_covariance_in_enu_m2,
        "heading_sigma_deg": pose.heading_sigma_deg,
        "height_sigma_m": pose.height_sigma_m,
        "flags": pose.flags,
        "quaymark_pose_id": pose.id,
        "run_id": pose.run_id,
        "registration_id": pose.view.registration_id,
        "source": pose.source,
        "split": pose.part,
        "grade": grade,
        "reasons": reasons,
        "guideline_version": guideline_version,
    }


def _verdict(review: ReviewRecord | None) -> tuple[str | None, list[str], int | None]:
    if review is None:
        return None, [], None
    return review.grade, list(review.reasons), review.guideline_version
