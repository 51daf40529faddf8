"""What every writer gets: light records of poses, and a source that gives them again and again.

A format that keeps several files of the same poses reads its source several times; no writer holds
more than a few hundred poses, so that years of them fit into little memory.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from app.exports.writers.pose_table import PoseTable

Pixels = Sequence[list[float] | None]
Matrix = Sequence[Sequence[float]]


@dataclass(slots=True)
class ImageRecord:
    """A photograph; `suffix` is that of its media type, with the dot.

    `captured_at` is ISO 8601 with Z. `number` is its place among the photographs of the selection,
    counted from 1.
    """

    id: int
    file_name: str
    sha256: str
    width_px: int
    height_px: int
    captured_at: str
    camera_id: int = 0
    suffix: str = ".jpg"
    number: int = 0


@dataclass(slots=True)
class ReviewRecord:
    """The verdict on a pose that counts; `created_at` is ISO 8601 with Z."""

    grade: str
    reasons: Sequence[str]
    guideline_version: int
    created_at: str


@dataclass(slots=True)
class ViewRecord:
    """The camera as one registration has it: K in px, OpenCV's distortion, geocentric pose.

    `X_cam = R_cam_from_ecef (X_ecef - center_ecef_m)`; heights are ellipsoidal (WGS84).
    """

    registration_id: int
    viewport_id: int
    camera_id: int
    site_id: int
    width_px: int
    height_px: int
    K: Matrix
    distortion: Sequence[float]
    R_cam_from_ecef: Matrix
    center_ecef_m: Sequence[float]
    water_level_m: float


@dataclass(slots=True)
class PoseRecord:
    """A pose with all it was made of: metres, degrees, px, Rodrigues vectors, camera frame OpenCV.

    `vessel` is the MMSI, or a stable pseudonym where the export is anonymised. `source` says who
    the box and vessel are from: `generated`, or a person's: `edited`, `rematched`, `person_made`.
    `part` is where a split puts it.
    """

    id: int
    run_id: int
    view: ViewRecord
    image: ImageRecord
    vessel: str
    box_px: tuple[float, float, float, float]
    score: float
    cost: float
    centroid_in_cam_m: Sequence[float]
    rotation_cam_from_vessel: Matrix
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
    position_covariance_in_enu_m2: Matrix | None
    heading_sigma_deg: float | None
    height_sigma_m: float | None
    flags: Sequence[str]
    review: ReviewRecord | None
    source: str = "generated"
    part: str | None = None

    def judged(self) -> dict[str, object]:
        """Return what formats say of a pose beside its geometry: verdict, flags, source."""
        return {
            "grade": None if self.review is None else self.review.grade,
            "reasons": [] if self.review is None else list(self.review.reasons),
            "flags": list(self.flags),
            "source": self.source,
        }


@dataclass(slots=True)
class StateRecord:
    """A vessel's AIS state at the time of an image, matched or not."""

    vessel: str
    lat_deg: float
    lon_deg: float
    heading_deg: float
    speed_kn: float
    age_s: float
    to_bow_m: float
    to_stern_m: float
    to_port_m: float
    to_starboard_m: float


@dataclass(slots=True)
class BoxRecord:
    """A 2D box that a person drew; ids and category as the file had them that it came with."""

    id: int
    image_id: int
    category_id: int
    bbox_px: Sequence[float]
    area_px2: float
    is_crowd: bool
    is_ignored: bool = False


@dataclass(slots=True)
class Frame:
    """A photograph as one registration sees it, with its poses and the AIS states they are from.

    `boxes` are those people drew in it; None where nobody looked.
    """

    view: ViewRecord
    image: ImageRecord
    poses: Sequence[PoseRecord]
    states: Sequence[StateRecord] = ()
    boxes: Sequence[BoxRecord] | None = None


class Identities(Protocol):
    """What an export says of vessels and of the files they are on."""

    def vessel(self, mmsi: int) -> str:
        """Return what stands for a vessel."""
        ...

    def file_name(self, name: str, sha256: str) -> str:
        """Return what a photograph is called."""
        ...


class Source(Protocol):
    """The poses of one export, or of one part of a split."""

    def __len__(self) -> int:
        """Return how many there are."""
        ...

    @property
    def parts(self) -> Sequence[str]:
        """The parts of a split, in order; empty without one."""
        ...

    def part(self, name: str) -> "Source":
        """Return the poses of one part."""
        ...

    def images(self) -> Iterator[ImageRecord]:
        """Give the photographs, by id."""
        ...

    def poses(self) -> Iterator[PoseRecord]:
        """Give the poses, by id."""
        ...

    def lines(self, write: "Callable[[PoseTable], bytes]") -> Iterator[bytes]:
        """Give what a writer's function makes of the poses, some at a time."""
        ...

    def gone(self) -> Iterator[int]:
        """Give the ids that changed since a moment and are no longer selected, in order."""
        ...

    def views(self) -> Sequence[ViewRecord]:
        """Return the cameras as registered, by registration."""
        ...

    def frames(
        self, registration_id: int | None = None, *, states: bool = False
    ) -> Iterator[Frame]:
        """Give the photographs of a registration (None: of all) with their poses, in order.

        With `states` also with AIS states and the boxes people drew.
        """
        ...

    def photograph(self, image: ImageRecord) -> Iterator[bytes] | None:
        """Give a photograph's bytes; None where photographs are left out."""
        ...

    def manifest(self) -> Mapping[str, object]:
        """Return what the selection is and where it comes from."""
        ...


def refuse_what_is_no_number(pose: PoseRecord) -> None:
    """Raise ValueError for NaN or infinity: only some readers would open the file."""
    x, y, z = pose.centroid_in_cam_m
    total = pose.score + pose.cost + pose.report_age_s + pose.lat_deg + pose.lon_deg
    total += pose.center_height_m + pose.heading_deg + x + y + z + sum(pose.box_px)
    if not isfinite(total + pose.length_m + pose.width_m + pose.height_m):
        raise ValueError(f"pose {pose.id} holds a number that is not finite")


def parts_of(source: Source) -> Iterator[tuple[str, Source]]:
    """Give the parts of a source with their names; `all` where nothing is split."""
    if not source.parts:
        yield "all", source
    for name in source.parts:
        yield name, source.part(name)
