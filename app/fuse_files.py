"""Fusion of one published label with its camera, without any database: `quaymark fuse`.

Reads a camera file and a label file in the format of the BONK-pose data set, takes the label's 2D
boxes as detections and its vessels as AIS states, and gives poses as plain JSON values. The world
frame is geocentric (ECEF) and the water lies at ellipsoidal height 0, as in the published data.
Labels are taken as their publisher chose them: the age of a report is no reason to leave it out.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.fusion import FusedPose, FusionSettings, Preset, fuse
from app.domain.geodesy import EcefFrame
from app.domain.vessel_state import VesselState
from app.errors import Invalid

PUBLISHED_WATER_LEVEL_M = 0.0
_SPEED_NOT_AVAILABLE_KN = 102.3  # ITU-R M.1371, speed over ground 1023
_HEADINGS_END_DEG = 360.0  # 511 means "not available"


class FuseFilesError(Invalid):
    """An input that cannot be used: one line naming the file, the field and the fix."""


class _Published(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)


_Row3 = Annotated[list[float], Field(min_length=3, max_length=3)]


class _CameraFile(_Published):
    """Intrinsics and geocentric extrinsics; `distortion` is k1, k2, p1, p2 and maybe k3."""

    width: int
    height: int
    K: Annotated[list[_Row3], Field(min_length=3, max_length=3)]
    R_cam_from_ecef: Annotated[list[_Row3], Field(min_length=3, max_length=3)]
    center_ecef_m: _Row3
    distortion: Annotated[list[float], Field(min_length=4, max_length=5)] | None = None

    def camera(self) -> Camera:
        distortion = np.zeros(5)
        if self.distortion is not None:
            distortion[: len(self.distortion)] = self.distortion
        intrinsics = Intrinsics(self.width, self.height, np.array(self.K), distortion)
        return Camera(intrinsics, np.array(self.R_cam_from_ecef), np.array(self.center_ecef_m))


class _Object(_Published):
    """A published object; one without a 2D box (a pose only) is no detection."""

    bbImage2d: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None  # noqa: N815 - the published name


class _Size(_Published):
    to_bow: Annotated[float, Field(ge=0)] | None = None
    to_stern: Annotated[float, Field(ge=0)] | None = None
    to_port: Annotated[float, Field(ge=0)] | None = None
    to_starboard: Annotated[float, Field(ge=0)] | None = None


class _Vessel(_Published):
    """A published AIS state; whatever AIS may not know may be null or absent."""

    identifier: str | int
    lat: float | None = None
    long: float | None = None
    heading: float | None = None
    size: _Size | None = None
    speed: float | None = None
    secondsSinceLastPositionReport: float | None = None  # noqa: N815 - the published name

    def state(self) -> VesselState:
        """Give the state to fuse; NaN stands for what has no value, fusion names the reason."""
        size = self.size or _Size()
        heading = self.heading
        if heading is None or not 0 <= heading <= _HEADINGS_END_DEG:
            heading = float("nan")
        return VesselState(
            identifier=str(self.identifier),
            lat_deg=float("nan") if self.lat is None else self.lat,
            lon_deg=float("nan") if self.long is None else self.long,
            heading_deg=heading,
            speed_kn=0.0 if self.speed is None or not self.has_speed else self.speed,
            age_s=self.secondsSinceLastPositionReport or 0.0,
            to_bow_m=size.to_bow or 0.0,
            to_stern_m=size.to_stern or 0.0,
            to_port_m=size.to_port or 0.0,
            to_starboard_m=size.to_starboard or 0.0,
        )

    @property
    def has_speed(self) -> bool:
        return self.speed is not None and self.speed < _SPEED_NOT_AVAILABLE_KN

    def flags(self) -> list[str]:
        """Name what kept dead reckoning from moving the vessel."""
        missing_age = self.secondsSinceLastPositionReport is None
        named = {"no_speed": not self.has_speed, "no_report_age": missing_age}
        return [flag for flag, holds in named.items() if holds]


class _LabelFile(_Published):
    objects: list[_Object]
    vessels: list[_Vessel]


_Model = TypeVar("_Model", bound=BaseModel)


def fuse_files(
    camera_path: Path, label_path: Path, preset: str = Preset.PAPER
) -> dict[str, object]:
    """Fuse a label's boxes with its vessels and return the JSON values of `quaymark fuse`.

    `unmatched_vessels` lists identifiers, `unmatched_vessel_reasons` the same vessels with their
    position in the label and the reason. Raises FuseFilesError with one clear line.
    """
    if preset not in set(Preset):
        known = ", ".join(Preset)
        raise FuseFilesError(f"preset {preset!r} is not available here; choose one of: {known}")
    camera = _camera(camera_path)
    label = _read(_LabelFile, label_path)
    boxes = _boxes(label_path, label.objects)
    # The label's publisher has chosen the reports already: their age is no reason to drop them.
    settings = FusionSettings(preset=Preset(preset), maximum_report_age_s=float("inf"))
    try:
        result = fuse(
            camera,
            EcefFrame(),
            PUBLISHED_WATER_LEVEL_M,
            list(boxes.values()),
            [vessel.state() for vessel in label.vessels],
            settings,
        )
    except ValueError as error:
        raise FuseFilesError(f"{label_path}: {error}") from error
    object_indices = list(boxes)
    return {
        "poses": [
            _pose_values(pose, object_indices[pose.detection_index], label.vessels)
            for pose in result.poses
        ],
        "unmatched_detections": [object_indices[i] for i in result.unmatched_detections],
        "unmatched_vessels": [str(label.vessels[i].identifier) for i in result.unmatched_states],
        "unmatched_vessel_reasons": [
            {"vessel": i, "identifier": str(label.vessels[i].identifier), "reason": str(reason)}
            for i, reason in result.unmatched_states.items()
        ],
    }


def _camera(path: Path) -> Camera:
    values = _read(_CameraFile, path)
    try:
        return values.camera()
    except ValueError as error:
        raise FuseFilesError(f"{path}: {error}") from error


def _read(model: type[_Model], path: Path) -> _Model:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FuseFilesError(f"{path}: not UTF-8 text; give a JSON file") from error
    except OSError as error:
        raise FuseFilesError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"]) or "the file"
        more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
        raise FuseFilesError(f"{path}: {field}: {first['msg']}{more}") from error


def _boxes(path: Path, objects: Sequence[_Object]) -> dict[int, Detection]:
    """Give the 2D boxes by their index among the label's objects, each with score 1."""
    boxes = {}
    for index, found in enumerate(objects):
        if found.bbImage2d is None:
            continue
        x1, y1, x2, y2 = found.bbImage2d
        if x1 >= x2 or y1 >= y2:
            raise FuseFilesError(
                f"{path}: objects.{index}.bbImage2d: must be x1, y1, x2, y2 with x1 < x2, y1 < y2"
            )
        boxes[index] = Detection(x1, y1, x2, y2, score=1.0)
    return boxes


def _pose_values(
    pose: FusedPose, object_index: int, vessels: Sequence[_Vessel]
) -> dict[str, object]:
    vessel = vessels[pose.state_index]
    east, north, up = pose.correction_in_enu_m.tolist()
    return {
        "identifier": str(vessel.identifier),
        "detection": object_index,
        "vessel": pose.state_index,
        "cost": pose.cost,
        "cost_terms": pose.cost_terms,
        "centroid_in_cam_m": pose.centroid_in_cam_m.tolist(),
        "rotvec_cam_from_vessel": pose.rotvec_cam_from_vessel.tolist(),
        "length_m": pose.length_m,
        "width_m": pose.width_m,
        "height_m": pose.height_m,
        "corners_in_image_px": _pixels(pose.corners_in_image_px),
        "correction_m": {"east": east, "north": north, "up": up},
        "flags": pose.flags + vessel.flags(),
    }


def _pixels(pixels_px: FloatArray) -> list[list[float] | None]:
    """Give rows as JSON knows them: null for a point without a projection."""
    return [None if np.isnan(row).any() else row.tolist() for row in pixels_px]
