"""Errors of poses: each kind of displacement shows in its own figure."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.metrics import BoxPose, best_covered, box_iou, pose_error, spread

ANGLES = st.floats(-180, 180)
SHIFTS = st.floats(-50, 50)


def box(heading_deg: float, *, east: float = 0, north: float = 0, up: float = 0) -> BoxPose:
    """Return a ship of 40 x 8 x 10 m seen by a level camera that looks north from 300 m south."""
    turn = np.radians(heading_deg)
    forward = np.array([np.sin(turn), np.cos(turn), 0.0])
    axes_in_enu = np.column_stack([forward, np.cross([0, 0, 1.0], forward), [0, 0, 1.0]])
    cam_from_enu = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    rotvec, _ = cv2.Rodrigues(cam_from_enu @ axes_in_enu)
    return BoxPose(
        centroid_in_cam_m=cam_from_enu @ np.array([east, north + 300.0, up - 20.0]),
        rotvec_cam_from_vessel=rotvec.ravel(),
        length_m=40.0,
        width_m=8.0,
        height_m=10.0,
    )


@given(ANGLES)
def test_the_true_pose_has_no_error(heading_deg: float) -> None:
    """A pose compared with itself is off by nothing in any figure."""
    error = pose_error(box(heading_deg), box(heading_deg))
    assert error.horizontal_m == pytest.approx(0, abs=1e-9)
    assert error.vertical_m == pytest.approx(0, abs=1e-9)
    assert error.heading_deg == pytest.approx(0, abs=1e-4)
    assert error.add_s_m == pytest.approx(0, abs=1e-9)


@given(ANGLES, SHIFTS, SHIFTS, SHIFTS)
def test_a_shift_along_the_water_is_horizontal_and_a_lift_is_vertical(
    heading_deg: float, east: float, north: float, up: float
) -> None:
    """Displacements along the water and along the normal do not mix, whatever the heading."""
    error = pose_error(box(heading_deg, east=east, north=north, up=up), box(heading_deg))
    assert error.horizontal_m == pytest.approx(np.hypot(east, north), abs=1e-6)
    assert error.vertical_m == pytest.approx(up, abs=1e-6)


@given(ANGLES, st.floats(0, 180))
def test_a_turn_is_the_angle_between_the_bows(heading_deg: float, turn_deg: float) -> None:
    """The heading error lies between 0 and 180 degrees and counts a swapped bow as 180."""
    error = pose_error(box(heading_deg + turn_deg), box(heading_deg))
    assert error.heading_deg == pytest.approx(turn_deg, abs=1e-4)


def test_add_s_forgives_a_swapped_bow_and_stern() -> None:
    """The symmetric distance takes the nearest corner, so a box turned by 180 degrees fits."""
    assert pose_error(box(210), box(30)).add_s_m == pytest.approx(0, abs=1e-6)


@given(st.floats(0.1, 3.9))
def test_add_s_of_a_small_shift_is_the_shift(shift_m: float) -> None:
    """Below half the beam every corner's nearest neighbour is its own."""
    assert pose_error(box(0, east=shift_m), box(0)).add_s_m == pytest.approx(shift_m, abs=1e-9)


def test_a_taller_box_on_the_same_water_has_no_vertical_error() -> None:
    """Only where the box stands is vertical error; the rest of a tall box is height error."""
    true = box(30)
    up_in_cam = np.array([0.0, -1.0, 0.0])
    tall = BoxPose(
        true.centroid_in_cam_m + 2.0 * up_in_cam, true.rotvec_cam_from_vessel, 40.0, 8.0, 14.0
    )
    error = pose_error(tall, true)
    assert error.vertical_m == pytest.approx(0, abs=1e-9)
    assert error.height_m == pytest.approx(4.0)


def test_a_spread_sums_up_absolute_errors() -> None:
    """Signs do not cancel, and no errors give no figure."""
    summed = spread([-1.0, 1.0, -3.0])
    assert summed is not None
    assert (summed.count, summed.median) == (3, 1.0)
    assert spread([]) is None


def test_iou_of_boxes() -> None:
    """Half-overlapping boxes share a third; boxes apart share nothing."""
    assert box_iou((0, 0, 10, 10), (5, 0, 15, 10)) == pytest.approx(1 / 3)
    assert box_iou((0, 0, 10, 10), (10, 0, 20, 10)) == 0.0


def test_a_detection_is_of_the_vessel_it_covers_best() -> None:
    """The largest overlap wins, and a box beside all vessels is of none."""
    silhouettes = [(0.0, 0.0, 10.0, 10.0), (4.0, 0.0, 14.0, 10.0)]
    assert best_covered((5.0, 0.0, 15.0, 10.0), silhouettes) == 1
    assert best_covered((14.0, 0.0, 24.0, 10.0), silhouettes) is None
    assert best_covered((0.0, 0.0, 10.0, 10.0), []) is None
