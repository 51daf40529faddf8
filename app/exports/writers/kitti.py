"""KITTI 3D: a label file a photograph, 15 columns a vessel.

    PART/label_2/NUMBER.txt, calib/NUMBER.txt, pose/NUMBER.json, image_2/NUMBER.jpg

Columns: type, truncated, occluded, alpha, the 2D box, height width length, the middle of the
bottom face in the camera frame (x right, y down, z forward, metres), rotation_y. KITTI knows one
angle, around an axis that its cars share with the camera; a harbour camera looks down, so that the
angle alone loses the vessel's tilt against it. `pose/NUMBER.json` keeps the full rotation, line by
line as in the label. Occlusion is not known (3).

Format: A. Geiger, P. Lenz, R. Urtasun, "Are we ready for autonomous driving?" (2012), devkit.
"""

from collections.abc import Iterator
from math import atan2, pi

from app.exports.writers.json_bytes import json_bytes
from app.exports.writers.records import (
    Frame,
    PoseRecord,
    Source,
    ViewRecord,
    parts_of,
    refuse_what_is_no_number,
)
from app.exports.writers.silhouettes import visible_fraction
from app.exports.writers.zip_stream import Member

TYPE = "Vessel"
OCCLUSION_UNKNOWN = 3
_IDENTITY = "1 0 0 0 1 0 0 0 1"
_NO_TRANSFORM = "1 0 0 0 0 1 0 0 0 0 1 0"


def members(source: Source) -> Iterator[Member]:
    """Give the archive's files."""
    for part, of_part in parts_of(source):
        count = 0
        for number, frame in enumerate(of_part.frames()):
            count += 1
            yield from _frame(part, f"{number:06}", frame)
            photograph = of_part.photograph(frame.image)
            if photograph is not None:
                yield f"{part}/image_2/{number:06}{frame.image.suffix}", photograph
        yield f"ImageSets/{part}.txt", "".join(f"{n:06}\n" for n in range(count)).encode()


def _frame(part: str, number: str, frame: Frame) -> Iterator[Member]:
    lines = "".join(label_line(pose) + "\n" for pose in frame.poses)
    yield f"{part}/label_2/{number}.txt", lines.encode()
    yield f"{part}/calib/{number}.txt", calibration(frame.view).encode()
    yield f"{part}/pose/{number}.json", json_bytes(_sidecar(frame)) + b"\n"


def label_line(pose: PoseRecord) -> str:
    """Return a vessel's 15 columns."""
    refuse_what_is_no_number(pose)
    x, y, z = bottom_center(pose)
    rotation_y = heading_in_cam(pose)
    alpha = _wrapped(rotation_y - atan2(x, z))
    fraction = visible_fraction(pose.corners_in_image_px, pose.image.width_px, pose.image.height_px)
    box = " ".join(f"{value:.4f}" for value in pose.box_px)
    numbers = (pose.height_m, pose.width_m, pose.length_m, x, y, z, rotation_y)
    return f"{TYPE} {1 - fraction:.4f} {OCCLUSION_UNKNOWN} {alpha:.9f} {box} " + " ".join(
        f"{value:.9f}" for value in numbers
    )


def bottom_center(pose: PoseRecord) -> tuple[float, float, float]:
    """Return the middle of the box's bottom face in the camera frame, m."""
    x, y, z = (
        center - row[2] * pose.height_m / 2
        for center, row in zip(pose.centroid_in_cam_m, pose.rotation_cam_from_vessel, strict=True)
    )
    return x, y, z


def heading_in_cam(pose: PoseRecord) -> float:
    """Return KITTI's rotation_y of the vessel's forward axis d: -atan2(d.z, d.x), rad."""
    rotation = pose.rotation_cam_from_vessel
    return -atan2(rotation[2][0], rotation[0][0])


def _wrapped(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi


def calibration(view: ViewRecord) -> str:
    """Return a calibration file: one camera, which stands for all four, and no other sensor."""
    rows = " ".join(f"{a!r} {b!r} {c!r} 0.0" for a, b, c in view.K)
    cameras = "".join(f"P{camera}: {rows}\n" for camera in range(4))
    return (
        f"{cameras}R0_rect: {_IDENTITY}\nTr_velo_to_cam: {_NO_TRANSFORM}\n"
        f"Tr_imu_to_velo: {_NO_TRANSFORM}\n"
    )


def _sidecar(frame: Frame) -> dict[str, object]:
    view = frame.view
    return {
        "file_name": frame.image.file_name,
        "sha256": frame.image.sha256,
        "captured_at": frame.image.captured_at,
        "registration_id": view.registration_id,
        "distortion": list(view.distortion),
        "R_cam_from_ecef": view.R_cam_from_ecef,
        "center_ecef_m": view.center_ecef_m,
        "objects": [
            {
                "R_cam_from_vessel": pose.rotation_cam_from_vessel,
                "centroid_in_cam_m": pose.centroid_in_cam_m,
                "corners_2d": pose.corners_in_image_px,
                "vessel": pose.vessel,
                **pose.judged(),
                "quaymark_pose_id": pose.id,
            }
            for pose in frame.poses
        ],
    }
