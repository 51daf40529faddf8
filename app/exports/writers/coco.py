"""COCO detection format with the 6D pose beside each box.

An annotation's `bbox` is the detection's box in px, its `segmentation` the silhouette of the
projected 3D box; the pose stands in the fields that BOP made common: `cam_R_m2c` (rotation of the
vessel axes in the camera frame, row by row) and `cam_t_m2c` (centroid, millimetres). Ids begin at 1
and are counted anew in every file; the installation's own ids stay beside them.
"""

from collections.abc import Iterator, Sequence
from itertools import islice, repeat

import numpy as np

from app.exports.writers.json_bytes import json_bytes, json_rows, sorted_json
from app.exports.writers.pose_table import PoseTable
from app.exports.writers.records import ImageRecord, ReviewRecord, Source
from app.exports.writers.silhouettes import silhouettes

CATEGORY = {"id": 1, "name": "vessel", "supercategory": "vessel"}
MM_PER_M = 1000.0
ROWS_AT_ONCE = 500
NAMES = (
    *("id", "image_id", "category_id", "bbox", "area", "iscrowd", "segmentation", "silhouette"),
    *("score", "cam_R_m2c", "cam_t_m2c", "dims_m", "corners_2d", "vessel", "heading_deg"),
    *("heading_source", "report_age_s", "matching_cost", "position_covariance_in_enu_m2"),
    *("heading_sigma_deg", "height_sigma_m", "flags", "quaymark_pose_id", "run_id"),
    *("registration_id", "source", "split", "grade", "reasons", "guideline_version"),
)
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


def annotations(poses: PoseTable) -> bytes:
    """Return a line of each pose, with commas between them and before all but the file's first."""
    poses.refuse_what_is_no_number()
    boxes = [(x1, y1, x2 - x1, y2 - y1) for x1, y1, x2, y2 in poses.boxes_px]
    outlines, kinds = silhouettes(poses.corners_in_image_px, poses.images, poses.boxes_px)
    grades, reasons, versions = zip(*map(_verdict, poses.reviews), strict=True)
    rows = json_rows(
        NAMES,
        b",\n",
        range(poses.first + 1, poses.first + 1 + len(poses.ids)),
        [image.number for image in poses.images],
        repeat(1, len(poses.ids)),
        boxes,
        [width * height for _, _, width, height in boxes],
        repeat(0, len(poses.ids)),
        zip(outlines, strict=True),
        kinds,
        poses.scores,
        poses.rotations_cam_from_vessel.reshape(-1, 9).tolist(),
        (np.array(poses.centroids_in_cam_m) * MM_PER_M).tolist(),
        zip(poses.lengths_m, poses.widths_m, poses.heights_m, strict=True),
        poses.corners_in_image_px,
        poses.vessels,
        poses.headings_deg,
        poses.heading_sources,
        poses.report_ages_s,
        poses.costs,
        poses.position_covariances_in_enu_m2,
        poses.heading_sigmas_deg,
        poses.height_sigmas_m,
        poses.flags,
        poses.ids,
        poses.run_ids,
        poses.registration_ids,
        poses.sources,
        poses.parts,
        grades,
        reasons,
        versions,
    )
    return (b",\n" if poses.first else b"") + rows


def _image(image: ImageRecord, folder: str) -> dict[str, object]:
    return {
        "id": image.number,
        "file_name": f"{folder}{image.sha256}{image.suffix}" if folder else image.file_name,
        "width": image.width_px,
        "height": image.height_px,
        "date_captured": image.captured_at,
        "quaymark_image_id": image.id,
        "sha256": image.sha256,
    }


def _verdict(review: ReviewRecord | None) -> tuple[str | None, Sequence[str], int | None]:
    if review is None:
        return None, [], None
    return review.grade, review.reasons, review.guideline_version
