"""Boxes that people edit: their projection, their place, and finding it from a drawn one."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.upright_box import (
    UprightBox,
    bottom_center_in_world,
    geodetic_of,
    local_camera,
    local_of,
    view_axes_in_local,
)
from app.domain.waterplane import vessel_axes

GOLDEN = Path(__file__).parents[2] / "golden" / "pose_projection.json"
CASES = json.loads(GOLDEN.read_text())["cases"]
NAMES = [case["name"] for case in CASES]


def camera_of(given: dict[str, Any]) -> Camera:
    """Return the camera of a golden case."""
    K = np.array(
        [[given["fx_px"], 0, given["cx_px"]], [0, given["fy_px"], given["cy_px"]], [0, 0, 1]]
    )
    intrinsics = Intrinsics(given["width_px"], given["height_px"], K, np.array(given["distortion"]))
    return Camera(
        intrinsics, np.array(given["R_cam_from_local"]), np.array(given["center_in_local_m"])
    )


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_the_server_projects_as_the_golden_file_says(case: dict[str, Any]) -> None:
    """Corners of upright boxes come out within 0.1 px, as the browser's must; null behind."""
    box = UprightBox(**case["box"])
    found = camera_of(case["camera"]).project(box.corners_in_local())
    expected = np.array(
        [[np.nan] * 2 if point is None else point for point in case["corners_in_image_px"]]
    )
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    assert np.nanmax(np.abs(found - expected)) < 0.1


def test_the_golden_cases_cover_what_differs() -> None:
    """There are cameras with and without distortion, and a box partly behind the camera."""
    assert {any(case["camera"]["distortion"]) for case in CASES} == {True, False}
    assert any(None in case["corners_in_image_px"] for case in CASES)


def harbour_camera() -> tuple[Camera, EnuFrame]:
    """Return a camera 30 m above the water that looks north, 5 degrees down, with distortion."""
    frame = EnuFrame(Geodetic(53.54, 9.98, 40.0))
    down = np.radians(5)
    R = np.array(
        [
            [1, 0, 0],
            [0, -np.sin(down), -np.cos(down)],
            [0, np.cos(down), -np.sin(down)],
        ]
    )
    K = np.array([[2600.0, 0, 1280], [0, 2600, 960], [0, 0, 1]])
    intrinsics = Intrinsics(2560, 1920, K, np.array([-0.1, 0.02, 0.001, -0.001, 0]))
    return Camera(intrinsics, R, np.array([0.0, 0.0, 30.0])), frame


@given(
    east=st.floats(-100, 100),
    north=st.floats(150, 1500),
    height=st.floats(-3, 3),
    heading=st.floats(0, 360),
    length=st.floats(3, 200),
    width=st.floats(1, 40),
)
def test_a_bottom_is_found_from_its_drawn_corners(
    east: float, north: float, height: float, heading: float, length: float, width: float
) -> None:
    """Its centre comes back to the centimetre, whatever water level it was put on."""
    camera, frame = harbour_camera()
    center = np.array([east, north, height])
    place = frame.geodetic(center)
    forward, port, up = vessel_axes(frame.axes(place.lat_deg, place.lon_deg), heading)
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    corners = center + signs @ np.vstack([forward * length / 2, port * width / 2])
    pixels = camera.project(corners)
    found = bottom_center_in_world(camera, up, forward, (length, width), pixels)
    assert found is not None
    assert np.linalg.norm(found - center) < 0.01
    assert bottom_center_in_world(camera, up, forward, (length, width), pixels * np.nan) is None


@given(east=st.floats(-500, 500), north=st.floats(-500, 500), up=st.floats(-5, 60))
def test_local_metres_and_degrees_are_each_others_inverse(
    east: float, north: float, up: float
) -> None:
    """A point of the local frame goes to WGS84 and back to the tenth of a millimetre."""
    _, frame = harbour_camera()
    reference = Geodetic(53.545, 9.985, 38.0)
    place = geodetic_of(frame, reference, [east, north, up])
    assert local_of(frame, reference, place) == pytest.approx([east, north, up], abs=1e-4)


def test_the_local_camera_sees_the_same() -> None:
    """A box drawn through the local camera has the pixels it has in the site's frame."""
    camera, frame = harbour_camera()
    reference = frame.geodetic(np.array([20.0, 400.0, 1.0]))
    local = local_camera(camera, frame, reference)
    box = UprightBox(3.0, -4.0, 0.0, 33.0, 80.0, 12.0, 9.0)
    R_local_from_world = frame.axes(reference.lat_deg, reference.lon_deg)
    world = box.corners_in_local() @ R_local_from_world + [20.0, 400.0, 1.0]
    assert local.project(box.corners_in_local()) == pytest.approx(camera.project(world), abs=1e-6)


def test_across_is_to_the_right_and_away_is_farther() -> None:
    """Moving across raises u, moving away raises the place in the image, both along the water."""
    camera, frame = harbour_camera()
    local = local_camera(camera, frame, frame.geodetic(np.array([20.0, 400.0, 0.0])))
    across, away = view_axes_in_local(local)
    here, right, farther = local.project(np.vstack([across * 0, across, away]))
    assert right[0] > here[0] + 1
    assert farther[1] < here[1]
    assert (across[2], away[2], across @ away) == pytest.approx((0, 0, 0))
