"""BONK-pose, the layout of the paper's data set: label, calibration and photograph by one name.

    [PART/][REGISTRATION/]camera.json, label/NAME.json, calib/NAME.txt, image/NAME.jpg

With one registration its files stand at the top, as `quaymark import bonk` takes them; further ones
have a folder each. As published, `height` is rounded up and `eulerAngles` is in truth a Rodrigues
vector; `height_exact` and the verdicts stand beside. `2d_annotation_gt` are the boxes that people
drew in the photograph, in COCO's form; where nobody drew any it is left out. `camera.json`, which
the authors do not publish, has the geocentric pose. A photograph keeps its name where that is plain
and not taken.
"""

import re
from collections.abc import Iterator
from math import ceil
from pathlib import PurePath

from app.exports.writers.json_bytes import json_bytes
from app.exports.writers.records import (
    BoxRecord,
    Frame,
    PoseRecord,
    Source,
    StateRecord,
    ViewRecord,
    parts_of,
    refuse_what_is_no_number,
)
from app.exports.writers.zip_stream import Member

_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")


def members(source: Source) -> Iterator[Member]:
    """Give the archive's files."""
    for part, of_part in parts_of(source):
        top = f"{part}/" if source.parts else ""
        views = of_part.views()
        for view in views:
            folder = top if len(views) == 1 else f"{top}{view.registration_id:06}/"
            yield f"{folder}camera.json", json_bytes(_camera(view)) + b"\n"
            yield from _frames(folder, of_part, view)


def _frames(folder: str, source: Source, view: ViewRecord) -> Iterator[Member]:
    taken: set[str] = set()
    for frame in source.frames(view.registration_id, states=True):
        name = _name(frame, taken)
        yield f"{folder}label/{name}.json", json_bytes(label(frame)) + b"\n"
        yield f"{folder}calib/{name}.txt", calibration(view).encode()
        photograph = source.photograph(frame.image)
        if photograph is not None:
            yield f"{folder}image/{name}{frame.image.suffix}", photograph


def _name(frame: Frame, taken: set[str]) -> str:
    name = PurePath(frame.image.file_name).stem
    if not _PLAIN.fullmatch(name) or name.casefold() in taken:
        name = frame.image.sha256
    taken.add(name.casefold())
    return name


def label(frame: Frame) -> dict[str, object]:
    """Return what is published of one photograph."""
    boxes = frame.boxes
    return {
        "objects": [_object(pose) for pose in frame.poses],
        **({} if boxes is None else {"2d_annotation_gt": [_annotation(box) for box in boxes]}),
        "vessels": [_vessel(state) for state in frame.states],
    }


def _object(pose: PoseRecord) -> dict[str, object]:
    refuse_what_is_no_number(pose)
    return {
        "identifier": pose.vessel,
        "bbImage2d": list(pose.box_px),
        "height": ceil(pose.height_m),
        "width": whole_number(pose.width_m),
        "length": whole_number(pose.length_m),
        "position": {
            "centroid": list(pose.centroid_in_cam_m),
            "eulerAngles": [[value] for value in pose.rotvec_cam_from_vessel],
        },
        "height_exact": pose.height_m,
        **pose.judged(),
    }


def _annotation(box: BoxRecord) -> dict[str, object]:
    """Return a box that a person drew as COCO has it."""
    return {
        "id": box.id,
        "image_id": box.image_id,
        "category_id": box.category_id,
        "segmentation": [],
        "bbox": list(box.bbox_px),
        "ignore": int(box.is_ignored),
        "iscrowd": int(box.is_crowd),
        "area": box.area_px2,
    }


def _vessel(state: StateRecord) -> dict[str, object]:
    return {
        "identifier": state.vessel,
        "lat": state.lat_deg,
        "long": state.lon_deg,
        "heading": whole_number(state.heading_deg),
        "size": {
            "to_stern": whole_number(state.to_stern_m),
            "to_bow": whole_number(state.to_bow_m),
            "to_starboard": whole_number(state.to_starboard_m),
            "to_port": whole_number(state.to_port_m),
        },
        "speed": state.speed_kn,
        "secondsSinceLastPositionReport": state.age_s,
    }


def whole_number(value: float) -> float:
    """Return a number as published: whole ones without a fraction."""
    return int(value) if value.is_integer() else value


def calibration(view: ViewRecord) -> str:
    """Return K as published: three rows, six decimals."""
    return "".join(f"{a:.6f} {b:.6f} {c:.6f}\n" for a, b, c in view.K)


def _camera(view: ViewRecord) -> dict[str, object]:
    return {
        "width": view.width_px,
        "height": view.height_px,
        "K": view.K,
        "distortion": view.distortion,
        "R_cam_from_ecef": view.R_cam_from_ecef,
        "center_ecef_m": view.center_ecef_m,
        "water_level_m": view.water_level_m,
    }
