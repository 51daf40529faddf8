"""What a camera's wrong registration does to all ships, by its covariance and by projection."""

import numpy as np
import pytest

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.camera_spread import place_covariance, shared_covariance
from app.domain.fusion_settings import FusionSettings
from app.domain.rotations import matrix_from_rotvec
from app.simulation.roadstead import RoadsteadSettings, make_roadstead

SETTINGS = FusionSettings(rotation_sigma_deg=1e-5, level_sigma_m=1e-5)
UP = np.array([0.0, 0.0, 1.0])


def shifts_shown(found: Camera, true: Camera, points: FloatArray) -> FloatArray:
    """Return by how much (n, 3) the camera found shows points beside where they are."""
    apparent = true.to_cam(points) @ found.R_cam_from_world + found.center_in_world
    return np.asarray(apparent - points)


@pytest.mark.parametrize("part", range(6))
def test_a_registration_error_is_what_ships_share(part: int) -> None:
    """Each error of the registration shows ships as its covariance says, with its sign."""
    found = make_roadstead(0, RoadsteadSettings(ships=1)).true_camera
    error = np.array([3e-4, 2e-4, -4e-4, 0.2, -0.1, 0.3]) * (np.arange(6) == part)
    true = Camera(
        found.intrinsics,
        matrix_from_rotvec(error[:3]) @ found.R_cam_from_world,
        found.center_in_world + error[3:],
    )
    points = np.array([[x, y, 0.0] for x in (-90, 0, 90) for y in (300, 600, 900)])
    shifts = shifts_shown(found, true, points)
    away = points - found.center_in_world
    range_m = np.linalg.norm(away, axis=1)
    columns = np.column_stack([np.ones(9), range_m, away @ found.R_cam_from_world[0]])
    level, pitch, roll = np.linalg.lstsq(columns, shifts @ UP, rcond=None)[0]
    yaw = np.mean(shifts[:, 0] / range_m) if part < 3 else 0.0
    unsure = Camera(
        found.intrinsics, found.R_cam_from_world, found.center_in_world, np.outer(error, error)
    )
    # In metres at 500 m, where a hundredth of one is nothing.
    metres = np.array([1.0, 500.0, 500.0, 500.0])
    shared = np.array([level, pitch, yaw, roll]) * metres
    np.testing.assert_allclose(
        shared_covariance(unsure, SETTINGS) * np.outer(metres, metres),
        np.outer(shared, shared),
        atol=1.5e-3,
    )
    east_north = shifts[:, :2].mean(axis=0) if part > 2 else np.zeros(2)
    np.testing.assert_allclose(
        place_covariance(unsure), np.outer(east_north, east_north), atol=1e-9
    )
