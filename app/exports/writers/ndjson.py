"""NDJSON: one pose a line, and a last line that says the file is complete.

A reader that does not find `{"type": "end", "complete": true, ...}` at the end holds a torn file.
An incremental export also tells what is gone, a line each: `{"type": "gone", "id": 7}`.
"""

from collections.abc import Iterator
from itertools import repeat

import orjson

from app.exports.writers.json_bytes import ascii_json, ascii_texts, json_bytes, json_rows
from app.exports.writers.pose_table import PoseTable
from app.exports.writers.records import ImageRecord, ReviewRecord, Source

NAMES = (
    *("type", "id", "run_id", "registration_id", "viewport_id", "image", "vessel", "box_px"),
    *("score", "cost", "centroid_in_cam_m", "rotation_cam_from_vessel", "rotvec_cam_from_vessel"),
    *("lat_deg", "lon_deg", "center_height_m", "heading_deg", "heading_source", "report_age_s"),
    *("length_m", "width_m", "height_m", "corners_in_image_px", "correction_in_enu_m"),
    *("position_covariance_in_enu_m2", "heading_sigma_deg", "height_sigma_m", "flags"),
    *("review", "source", "split"),
)


def write(source: Source) -> Iterator[bytes]:
    """Give the file in chunks; memory stays small."""
    gone = 0
    yield from source.lines(pose_lines)
    for pose_id in source.gone():
        gone += 1
        yield json_bytes({"type": "gone", "id": pose_id}) + b"\n"
    # ASCII only: some readers also end a line at the separators U+0085, U+2028 and U+2029.
    end = {"type": "end", "complete": True, "poses": len(source), "gone": gone}
    yield ascii_json(end | dict(source.manifest())) + b"\n"


def pose_lines(poses: PoseTable) -> bytes:
    """Return a line of each pose."""
    poses.refuse_what_is_no_number()
    once = {image.id: image for image in poses.images}
    images = {image_id: orjson.Fragment(_image(image)) for image_id, image in once.items()}
    rows = json_rows(
        NAMES,
        b"\n",
        repeat("pose", len(poses.ids)),
        poses.ids,
        poses.run_ids,
        poses.registration_ids,
        poses.viewport_ids,
        [images[image.id] for image in poses.images],
        poses.vessels,
        poses.boxes_px,
        poses.scores,
        poses.costs,
        poses.centroids_in_cam_m,
        poses.rotations_cam_from_vessel.tolist(),
        poses.rotvecs_cam_from_vessel,
        poses.lats_deg,
        poses.lons_deg,
        poses.center_heights_m,
        poses.headings_deg,
        poses.heading_sources,
        poses.report_ages_s,
        poses.lengths_m,
        poses.widths_m,
        poses.heights_m,
        poses.corners_in_image_px,
        poses.corrections_in_enu_m,
        poses.position_covariances_in_enu_m2,
        poses.heading_sigmas_deg,
        poses.height_sigmas_m,
        poses.flags,
        [review and _review(review) for review in poses.reviews],
        poses.sources,
        poses.parts,
    )
    return rows + b"\n"


def _image(image: ImageRecord) -> bytes:
    return ascii_texts(
        {
            "id": image.id,
            "camera_id": image.camera_id,
            "file_name": image.file_name,
            "sha256": image.sha256,
            "width_px": image.width_px,
            "height_px": image.height_px,
            "captured_at": image.captured_at,
        }
    )


def _review(review: ReviewRecord) -> dict[str, object]:
    return {
        "grade": review.grade,
        "reasons": review.reasons,
        "guideline_version": review.guideline_version,
        "created_at": review.created_at,
    }
