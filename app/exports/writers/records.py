"""What every writer gets: plain records of poses and of the selection they come from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

Pixels = Sequence[Sequence[float] | None]


@dataclass(frozen=True, slots=True)
class ImageRecord:
    """A photograph."""

    id: int
    file_name: str
    sha256: str
    width_px: int
    height_px: int
    captured_at: datetime


@dataclass(frozen=True, slots=True)
class ReviewRecord:
    """The newest standing verdict on a pose."""

    grade: str
    reasons: Sequence[str]
    guideline_version: int
    created_at: datetime


@dataclass(frozen=True, slots=True)
class PoseRecord:
    """A pose with all it was made of: metres, degrees, px, Rodrigues vectors, camera frame OpenCV.

    `vessel` is the MMSI, or a stable pseudonym where the export is anonymised. `source` says who
    the box and vessel are from: `generated`, or a person's: `edited`, `rematched`, `person_made`.
    """

    id: int
    run_id: int
    registration_id: int
    image: ImageRecord
    vessel: str
    box_px: tuple[float, float, float, float]
    score: float
    cost: float
    centroid_in_cam_m: Sequence[float]
    rotation_cam_from_vessel: Sequence[Sequence[float]]
    rotvec_cam_from_vessel: Sequence[float]
    lat_deg: float
    lon_deg: float
    center_height_m: float
    heading_deg: float
    heading_source: str
    report_age_s: float
    length_m: float
    width_m: float
    height_m: float
    corners_in_image_px: Pixels
    correction_in_enu_m: Sequence[float]
    flags: Sequence[str]
    review: ReviewRecord | None
    source: str = "generated"


@dataclass(frozen=True, slots=True)
class Selection:
    """Where the records come from: the filters, the runs and the code, for the record.

    `remains`: what an anonymised file may still tell; None where it tells all.
    """

    filters: Mapping[str, object]
    anonymised: bool
    remains: str | None
    runs: Sequence[Mapping[str, object]]
    code_version: str
    pose_count: int
