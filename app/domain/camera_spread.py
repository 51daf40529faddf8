"""How unsure a registered camera is, in terms of what all ships before it share.

A camera that was registered a little off shows all ships too high or too low, turned aside, tilted.
From the covariance of its registration follows how much, and what of it goes together: a camera
taken for too high is mostly taken for looking down too much as well, so that places near its
landmarks come out right. Whatever else moves it since is the setting's `rotation_sigma_deg`.
"""

from math import radians

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.fusion_settings import FusionSettings

# Rows: level (m, up), pitch (farther ships higher), yaw (all to the right), roll (ships on the
# right higher); columns: rotation about the camera's axes, its centre east, north, up. A camera
# that really stands higher sees the water lower.
_SHOWN = np.zeros((4, 6))
_SHOWN[0, 5] = _SHOWN[3, 2] = -1.0
_SHOWN[1, 0] = _SHOWN[2, 1] = 1.0
_EAST_NORTH = slice(3, 5)


def shared_covariance(camera: Camera, settings: FusionSettings) -> FloatArray:
    """Return the covariance (4, 4) of level (m), pitch, yaw and roll (rad) before looking."""
    rotation = radians(settings.rotation_sigma_deg)
    covariance = np.diag(np.array([settings.level_sigma_m, rotation, rotation, rotation]) ** 2)
    if camera.covariance is not None:
        covariance += _SHOWN @ camera.covariance @ _SHOWN.T
    return covariance


def place_covariance(camera: Camera) -> FloatArray:
    """Return the covariance (2, 2) of how far east and north all ships are shown beside it, m^2."""
    if camera.covariance is None:
        return np.zeros((2, 2))
    return camera.covariance[_EAST_NORTH, _EAST_NORTH]
