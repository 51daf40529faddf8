"""BOP, the benchmark of 6D object pose: a folder a scene, a mesh for every vessel size.

    PART/SCENE/scene_camera.json, scene_gt.json, scene_gt_info.json, rgb/NUMBER.jpg
    models/models_info.json, models/obj_NUMBER.ply

A scene is what one registration of a viewport sees. Everything is in millimetres; `cam_R_m2c` and
`cam_t_m2c` take a model's point into the camera frame, and a model is the vessel's box around its
centre, axes forward, port and up. There are no masks, so `scene_gt_info.json` counts pixels of
rectangles: `bbox_obj` encloses the projected box, `bbox_visib` is what of it the photograph shows.
`frames.json` tells which photograph, pose and vessel each entry is.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md
"""

import struct
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from app.exports.writers.json_bytes import json_bytes
from app.exports.writers.records import (
    Frame,
    PoseRecord,
    Source,
    ViewRecord,
    parts_of,
    refuse_what_is_no_number,
)
from app.exports.writers.silhouettes import enclosing_box, visible_fraction
from app.exports.writers.zip_stream import Member

MM_PER_M = 1000.0
DEPTH_SCALE = 1.0
SIZES_AT_ONCE = 4096
_SIGNS = np.array(
    [[x, y, z] for z in (-1, 1) for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))], np.float64
)
_TRIANGLES = (
    *((0, 1, 2), (0, 2, 3), (4, 6, 5), (4, 7, 6), (0, 4, 5), (0, 5, 1)),
    *((1, 5, 6), (1, 6, 2), (2, 6, 7), (2, 7, 3), (3, 7, 4), (3, 4, 0)),
)
Sizes = npt.NDArray[np.void]
_SIZE = np.dtype([("length", "<i4"), ("width", "<i4"), ("height", "<i4")])


def members(source: Source) -> Iterator[Member]:
    """Give the archive's files."""
    sizes = vessel_sizes(source)
    for part, of_part in parts_of(source):
        for view in of_part.views():
            yield from _scene(f"{part}/{view.registration_id:06}", of_part, view, sizes)
    yield "models/models_info.json", _models_info(sizes)
    for number, size in enumerate(sizes.tolist(), start=1):
        yield f"models/obj_{number:06}.ply", box_mesh(*size)


def vessel_sizes(source: Source) -> Sizes:
    """Return the distinct (length, width, height) of all poses, whole mm, in order.

    An object's id is its place, counted from 1.
    """
    found = np.empty(0, _SIZE)
    some: list[tuple[int, int, int]] = []
    for pose in source.poses():
        refuse_what_is_no_number(pose)
        some.append(size_mm(pose))
        if len(some) == SIZES_AT_ONCE:
            found = np.union1d(found, np.array(some, _SIZE))
            some.clear()
    return np.union1d(found, np.array(some, _SIZE))


def size_mm(pose: PoseRecord) -> tuple[int, int, int]:
    """Return a vessel's size in whole mm."""
    length, width, height = (
        round(value * MM_PER_M) for value in (pose.length_m, pose.width_m, pose.height_m)
    )
    return length, width, height


def object_id(pose: PoseRecord, sizes: Sizes) -> int:
    """Return the object that has a vessel's size."""
    return int(np.searchsorted(sizes, np.array(size_mm(pose), _SIZE))) + 1


def _scene(folder: str, source: Source, view: ViewRecord, sizes: Sizes) -> Iterator[Member]:
    def told(of_frame: Callable[[Frame], object]) -> Iterator[bytes]:
        lead = b"{\n"
        for number, frame in enumerate(source.frames(view.registration_id)):
            yield lead + f'"{number}":'.encode() + json_bytes(of_frame(frame))
            lead = b",\n"
        yield (b"{" if lead == b"{\n" else b"\n") + b"}\n"

    yield f"{folder}/scene_camera.json", told(lambda frame: _camera(frame.view))
    yield (
        f"{folder}/scene_gt.json",
        told(lambda frame: [_truth(pose, object_id(pose, sizes)) for pose in frame.poses]),
    )
    yield f"{folder}/scene_gt_info.json", told(lambda frame: [_info(p) for p in frame.poses])
    yield f"{folder}/frames.json", told(_provenance)
    for number, frame in enumerate(source.frames(view.registration_id)):
        photograph = source.photograph(frame.image)
        if photograph is not None:
            yield f"{folder}/rgb/{number:06}{frame.image.suffix}", photograph


def _camera(view: ViewRecord) -> dict[str, object]:
    """Tell the camera; the world is geocentric (EPSG:4978), in mm."""
    R = np.array(view.R_cam_from_ecef)  # noqa: N806  the field's symbol
    t_mm = -R @ np.array(view.center_ecef_m) * MM_PER_M
    return {
        "cam_K": [value for row in view.K for value in row],
        "depth_scale": DEPTH_SCALE,
        "cam_R_w2c": R.ravel().tolist(),
        "cam_t_w2c": t_mm.tolist(),
        "distortion": list(view.distortion),
        "width": view.width_px,
        "height": view.height_px,
    }


def _truth(pose: PoseRecord, obj_id: int) -> dict[str, object]:
    return {
        "cam_R_m2c": [value for row in pose.rotation_cam_from_vessel for value in row],
        "cam_t_m2c": [value * MM_PER_M for value in pose.centroid_in_cam_m],
        "obj_id": obj_id,
    }


def _info(pose: PoseRecord) -> dict[str, object]:
    box = enclosing_box(pose.corners_in_image_px)
    width, height = pose.image.width_px, pose.image.height_px
    fraction = visible_fraction(pose.corners_in_image_px, width, height)
    if box is None or fraction == 0.0:
        nowhere = [-1, -1, -1, -1]  # as the format tells what cannot be seen
        return {
            "bbox_obj": nowhere if box is None else _rectangle(*box),
            "bbox_visib": nowhere,
            "px_count_all": 0,
            "px_count_valid": 0,
            "px_count_visib": 0,
            "visib_fract": 0.0,
        }
    x1, y1, x2, y2 = box
    seen = (max(x1, 0.0), max(y1, 0.0), min(x2, float(width)), min(y2, float(height)))
    pixels = round((x2 - x1) * (y2 - y1))
    return {
        "bbox_obj": _rectangle(*box),
        "bbox_visib": _rectangle(*seen),
        "px_count_all": pixels,
        "px_count_valid": round(pixels * fraction),
        "px_count_visib": round(pixels * fraction),
        "visib_fract": fraction,
    }


def _rectangle(x1: float, y1: float, x2: float, y2: float) -> list[float]:
    return [x1, y1, x2 - x1, y2 - y1]


def _provenance(frame: Frame) -> dict[str, object]:
    return {
        "file_name": frame.image.file_name,
        "sha256": frame.image.sha256,
        "poses": [
            {
                "quaymark_pose_id": pose.id,
                "vessel": pose.vessel,
                **pose.judged(),
                "corners_2d": pose.corners_in_image_px,
            }
            for pose in frame.poses
        ],
    }


def _models_info(sizes: Sizes) -> Iterator[bytes]:
    lead = b"{\n"
    for number, (length, width, height) in enumerate(sizes.tolist(), start=1):
        yield lead + f'"{number}":'.encode() + json_bytes(_model(length, width, height))
        lead = b",\n"
    yield (b"{" if lead == b"{\n" else b"\n") + b"}\n"


def _model(length: int, width: int, height: int) -> dict[str, object]:
    """Tell a box. It is named no symmetry: a vessel has a bow."""
    return {
        "diameter": float(np.sqrt(length**2 + width**2 + height**2)),
        "min_x": -length / 2,
        "min_y": -width / 2,
        "min_z": -height / 2,
        "size_x": float(length),
        "size_y": float(width),
        "size_z": float(height),
    }


def box_mesh(length_mm: int, width_mm: int, height_mm: int) -> bytes:
    """Return a box around its centre as binary PLY, mm: corners in our order, 12 triangles."""
    corners = _SIGNS * [length_mm / 2, width_mm / 2, height_mm / 2]
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 8\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = b"".join(struct.pack("<Biii", 3, *triangle) for triangle in _TRIANGLES)
    return header.encode() + corners.astype("<f4").tobytes() + faces
