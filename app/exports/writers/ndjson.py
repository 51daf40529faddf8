"""NDJSON: one pose a line, and a last line that says the file is complete.

A reader that does not find `{"type": "end", "complete": true, ...}` at the end holds a torn file.
An incremental export also tells what is gone, a line each: `{"type": "gone", "id": 7}`.
"""

from collections.abc import Iterator, Sequence

import orjson

from app.exports.writers.json_bytes import ascii_json, ascii_texts, json_bytes, moment_text
from app.exports.writers.records import (
    ImageRecord,
    PoseRecord,
    ReviewRecord,
    Source,
    refuse_what_is_no_number,
)


def write(source: Source) -> Iterator[bytes]:
    """Give the file in chunks; memory stays small."""
    poses = gone = 0
    for lines in source.lines(pose_lines):
        poses += lines.count(b"\n")
        yield lines
    for pose_id in source.gone():
        gone += 1
        yield json_bytes({"type": "gone", "id": pose_id}) + b"\n"
    # ASCII only: some readers also end a line at the separators U+0085, U+2028 and U+2029.
    end = {"type": "end", "complete": True, "poses": poses, "gone": gone}
    yield ascii_json(end | dict(source.manifest())) + b"\n"


def pose_lines(_first: int, poses: Sequence[PoseRecord]) -> bytes:
    """Return a line of each pose."""
    lines: list[bytes] = []
    seen: ImageRecord | None = None
    image = orjson.Fragment(b"null")
    for pose in poses:
        if pose.image is not seen:
            seen = pose.image
            image = orjson.Fragment(_image(seen))
        lines.append(json_bytes(_pose(pose, image)))
    lines.append(b"")
    return b"\n".join(lines)


def _image(image: ImageRecord) -> bytes:
    return ascii_texts(
        {
            "id": image.id,
            "camera_id": image.camera_id,
            "file_name": image.file_name,
            "sha256": image.sha256,
            "width_px": image.width_px,
            "height_px": image.height_px,
            "captured_at": moment_text(image.captured_at),
        }
    )


def _pose(pose: PoseRecord, image: orjson.Fragment) -> dict[str, object]:
    refuse_what_is_no_number(pose)
    return {
        "type": "pose",
        "id": pose.id,
        "run_id": pose.run_id,
        "registration_id": pose.view.registration_id,
        "viewport_id": pose.view.viewport_id,
        "image": image,
        "vessel": pose.vessel,
        "box_px": pose.box_px,
        "score": pose.score,
        "cost": pose.cost,
        "centroid_in_cam_m": pose.centroid_in_cam_m,
        "rotation_cam_from_vessel": pose.rotation_cam_from_vessel,
        "rotvec_cam_from_vessel": pose.rotvec_cam_from_vessel,
        "lat_deg": pose.lat_deg,
        "lon_deg": pose.lon_deg,
        "center_height_m": pose.center_height_m,
        "heading_deg": pose.heading_deg,
        "heading_source": pose.heading_source,
        "report_age_s": pose.report_age_s,
        "length_m": pose.length_m,
        "width_m": pose.width_m,
        "height_m": pose.height_m,
        "corners_in_image_px": pose.corners_in_image_px,
        "correction_in_enu_m": pose.correction_in_enu_m,
        "position_covariance_in_enu_m2": pose.position_covariance_in_enu_m2,
        "heading_sigma_deg": pose.heading_sigma_deg,
        "height_sigma_m": pose.height_sigma_m,
        "flags": pose.flags,
        "review": None if pose.review is None else _review(pose.review),
        "source": pose.source,
        "split": pose.part,
    }


def _review(review: ReviewRecord) -> dict[str, object]:
    return {
        "grade": review.grade,
        "reasons": review.reasons,
        "guideline_version": review.guideline_version,
        "created_at": moment_text(review.created_at),
    }
