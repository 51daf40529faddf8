"""What became of poses between two runs."""

from collections.abc import Sequence
from itertools import count

from app.domain.pose_changes import Change, PlacedPose, paired_poses

BOXES = [(0.0, 0.0, 10.0, 10.0), (50.0, 0.0, 70.0, 10.0)]
_ids = count(1)


def pose(mmsi: int, box: int = 0, *, detection_id: int | None = None, **place: float) -> PlacedPose:
    """Return a pose of a vessel in one of two boxes."""
    values = {"lat_deg": 53.5, "lon_deg": 9.9, "base_height_m": 40.0, "heading_deg": 10.0} | place
    number = next(_ids)
    return PlacedPose(number, 1, detection_id or number + 1000, mmsi, BOXES[box], **values)


def changes(other: Sequence[PlacedPose], run: Sequence[PlacedPose]) -> list[list[Change]]:
    """Return what changed, pair by pair, from a metre and a degree on."""
    return sorted(pair.changes(1.0, 1.0) for pair in paired_poses(other, run))


def test_two_vessels_that_changed_boxes_are_other_vessels() -> None:
    """Boxes come before vessels: nobody jumped, both ships are said to be somebody else."""
    swapped = changes([pose(1, 0), pose(2, 1)], [pose(1, 1), pose(2, 0)])
    assert swapped == [[Change.OTHER_VESSEL], [Change.OTHER_VESSEL]]


def test_a_vessel_in_another_box_has_moved_and_what_is_left_is_new_or_gone() -> None:
    """Without its box a vessel is found by itself; others come and go."""
    found = changes([pose(1, 0), pose(2, 1)], [pose(3, 1), pose(1, 1, lat_deg=53.6)])
    assert found == [[Change.MOVED], [Change.OTHER_VESSEL]]
    assert changes([pose(1, 0)], [pose(2, 1)]) == [[Change.GONE], [Change.NEW]]


def test_of_two_boxes_over_each_other_the_vessel_decides() -> None:
    """A second box over the same ship does not make it another vessel."""
    assert changes([pose(1), pose(2)], [pose(2), pose(1)]) == [[], []]


def test_movement_is_told_in_metres_and_degrees_the_short_way_round() -> None:
    """A hundredth of a second of arc, across the date line and across north."""
    (pair,) = paired_poses(
        [pose(1, lon_deg=179.99999, lat_deg=0.0, heading_deg=359.0)],
        [pose(1, lon_deg=-179.99999, lat_deg=0.0, heading_deg=2.0, base_height_m=43.0)],
    )
    assert pair.moved_m is not None
    assert abs(pair.moved_m - (2.2264**2 + 3.0**2) ** 0.5) < 0.001
    assert pair.turned_deg == 3.0
    assert pair.changes(4.0, 2.0) == [Change.TURNED]
