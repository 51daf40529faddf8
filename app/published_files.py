"""The files of the BONK-pose data set: a camera, and a label with one image's boxes and vessels.

Shared by what fuses a label without a database and by what imports a whole data set. The world
frame of a camera file is geocentric (ECEF); the water lies at ellipsoidal height 0.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.vessel_state import VesselState
from app.errors import Invalid

PUBLISHED_WATER_LEVEL_M = 0.0
_SPEED_NOT_AVAILABLE_KN = 102.3  # ITU-R M.1371, speed over ground 1023
_HEADINGS_END_DEG = 360.0  # 511 means "not available"


class PublishedFileError(Invalid):
    """An input that cannot be used: one line naming the file, the field and the fix."""


class _Published(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)


_Row3 = Annotated[list[float], Field(min_length=3, max_length=3)]


class CameraFile(_Published):
    """Intrinsics and geocentric extrinsics; `distortion` is k1, k2, p1, p2 and maybe k3.

    `water_level_m` (ellipsoidal) stands in the files we write; the authors' data lie at 0.
    """

    width: int
    height: int
    K: Annotated[list[_Row3], Field(min_length=3, max_length=3)]
    R_cam_from_ecef: Annotated[list[_Row3], Field(min_length=3, max_length=3)]
    center_ecef_m: _Row3
    distortion: Annotated[list[float], Field(min_length=4, max_length=5)] | None = None
    water_level_m: float = PUBLISHED_WATER_LEVEL_M

    def camera(self) -> Camera:
        """Give the camera in the geocentric frame. Raises ValueError for an impossible one."""
        distortion = np.zeros(5)
        if self.distortion is not None:
            distortion[: len(self.distortion)] = self.distortion
        intrinsics = Intrinsics(self.width, self.height, np.array(self.K), distortion)
        return Camera(intrinsics, np.array(self.R_cam_from_ecef), np.array(self.center_ecef_m))


class PublishedObject(_Published):
    """A published object; one without a 2D box (a pose only) is no detection."""

    bbImage2d: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None  # noqa: N815 - the published name


class _Size(_Published):
    to_bow: Annotated[float, Field(ge=0)] | None = None
    to_stern: Annotated[float, Field(ge=0)] | None = None
    to_port: Annotated[float, Field(ge=0)] | None = None
    to_starboard: Annotated[float, Field(ge=0)] | None = None


class PublishedVessel(_Published):
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
        """Whether it says how fast it goes."""
        return self.speed is not None and self.speed < _SPEED_NOT_AVAILABLE_KN

    def flags(self) -> list[str]:
        """Name what kept dead reckoning from moving the vessel."""
        missing_age = self.secondsSinceLastPositionReport is None
        named = {"no_speed": not self.has_speed, "no_report_age": missing_age}
        return [flag for flag, holds in named.items() if holds]


class LabelFile(_Published):
    """What is published of one image; `boxes` are those people drew, None where nobody did."""

    objects: list[PublishedObject]
    vessels: list[PublishedVessel]
    boxes: Annotated[list[dict[str, Any]] | None, Field(alias="2d_annotation_gt")] = None


_Model = TypeVar("_Model", bound=BaseModel)


def read_camera(path: Path) -> Camera:
    """Read a camera file. Raises PublishedFileError."""
    values = _read(CameraFile, path)
    try:
        return values.camera()
    except ValueError as error:
        raise PublishedFileError(f"{path}: {error}") from error


def read_water_level_m(path: Path) -> float:
    """Read the water level of a camera file, m above the ellipsoid. Raises PublishedFileError."""
    return _read(CameraFile, path).water_level_m


def read_label(path: Path) -> LabelFile:
    """Read a label file. Raises PublishedFileError."""
    return _read(LabelFile, path)


def boxes_of(path: Path, objects: Sequence[PublishedObject]) -> dict[int, Detection]:
    """Give the 2D boxes by their index among the label's objects, each with score 1."""
    boxes = {}
    for index, found in enumerate(objects):
        if found.bbImage2d is None:
            continue
        x1, y1, x2, y2 = found.bbImage2d
        if x1 >= x2 or y1 >= y2:
            raise PublishedFileError(
                f"{path}: objects.{index}.bbImage2d: must be x1, y1, x2, y2 with x1 < x2, y1 < y2"
            )
        boxes[index] = Detection(x1, y1, x2, y2, score=1.0)
    return boxes


def _read(model: type[_Model], path: Path) -> _Model:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise PublishedFileError(f"{path}: not UTF-8 text; give a JSON file") from error
    except OSError as error:
        raise PublishedFileError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"]) or "the file"
        more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
        raise PublishedFileError(f"{path}: {field}: {first['msg']}{more}") from error
