"""What became of each pose from one run to another over the same image.

A pose is about a vessel seen in an image. It is found again in the other run by its detection (the
same one, or the box of another detector that covers it), else by its vessel. In this order: same
box and same vessel, same box and another vessel, same vessel in another box. What is left over is
new or gone. So a run that gives two vessels each other's boxes is told as two other vessels, not as
two that jumped.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import hypot
from typing import NamedTuple

from app.domain.local_metres import offset_m
from app.domain.metrics import Box, box_iou

SAME_BOX_IOU = 0.5


class Change(StrEnum):
    """How a pose differs from its counterpart; one may have moved and turned."""

    NEW = "new"
    GONE = "gone"
    OTHER_VESSEL = "other_vessel"
    MOVED = "moved"
    TURNED = "turned"


class PlacedPose(NamedTuple):
    """A pose of a run: where the middle of its bottom stands (WGS84, ellipsoidal), and its box."""

    id: int
    image_id: int
    detection_id: int
    mmsi: int
    box_px: Box
    lat_deg: float
    lon_deg: float
    base_height_m: float
    heading_deg: float


@dataclass(frozen=True, slots=True)
class PosePair:
    """A pose of the other run and its counterpart; one of them may be missing.

    `moved_m` is how far apart they stand, `turned_deg` the angle between their headings, 0 to 180;
    both None where one is missing.
    """

    other: PlacedPose | None
    run: PlacedPose | None
    moved_m: float | None = None
    turned_deg: float | None = None

    @property
    def image_id(self) -> int:
        """The image that both are of."""
        return self.present.image_id

    @property
    def present(self) -> PlacedPose:
        """The run's pose, or the other's where the run has none."""
        pose = self.run or self.other
        if pose is None:
            raise ValueError("a pair has at least one pose")
        return pose

    def changes(self, least_moved_m: float, least_turned_deg: float) -> list[Change]:
        """Return what changed: movements by more than so many metres and degrees."""
        if self.other is None:
            return [Change.NEW]
        if self.run is None:
            return [Change.GONE]
        found = [] if self.other.mmsi == self.run.mmsi else [Change.OTHER_VESSEL]
        if self.moved_m is not None and self.moved_m > least_moved_m:
            found.append(Change.MOVED)
        if self.turned_deg is not None and self.turned_deg > least_turned_deg:
            found.append(Change.TURNED)
        return found


def paired_poses(other: Sequence[PlacedPose], run: Sequence[PlacedPose]) -> list[PosePair]:
    """Pair the poses of two runs in one image, each at most once."""
    pairs: list[PosePair] = []
    rules: tuple[tuple[Callable[[PlacedPose, PlacedPose], float], float], ...] = (
        (lambda one, two: (one.mmsi == two.mmsi) * _same_box(one, two), SAME_BOX_IOU),
        (_same_box, SAME_BOX_IOU),
        (lambda one, two: float(one.mmsi == two.mmsi), 1.0),
    )
    left, right = list(other), list(run)
    for likeness, least in rules:
        for one, two in _best(left, right, likeness, least):
            left.remove(one)
            right.remove(two)
            pairs.append(_pair(one, two))
    pairs += [PosePair(one, None) for one in left]
    pairs += [PosePair(None, two) for two in right]
    return pairs


def _same_box(one: PlacedPose, two: PlacedPose) -> float:
    return 1.0 if one.detection_id == two.detection_id else box_iou(one.box_px, two.box_px)


def _best(
    left: Sequence[PlacedPose],
    right: Sequence[PlacedPose],
    likeness: Callable[[PlacedPose, PlacedPose], float],
    least: float,
) -> Iterable[tuple[PlacedPose, PlacedPose]]:
    """Give the likest pairs first, each pose once, down to a least likeness."""
    ranked = sorted(
        ((-likeness(one, two), one.id, two.id, one, two) for one in left for two in right),
        key=lambda candidate: candidate[:3],
    )
    taken: set[int] = set()
    gone: set[int] = set()
    for unlike, _, _, one, two in ranked:
        if -unlike < least:
            return
        if one.id not in taken and two.id not in gone:
            taken.add(one.id)
            gone.add(two.id)
            yield one, two


def _pair(other: PlacedPose, run: PlacedPose) -> PosePair:
    east_m, north_m = offset_m(other.lat_deg, other.lon_deg, run.lat_deg, run.lon_deg)
    up_m = run.base_height_m - other.base_height_m
    turned_deg = abs((run.heading_deg - other.heading_deg + 180) % 360 - 180)
    return PosePair(other, run, hypot(east_m, north_m, up_m), turned_deg)
