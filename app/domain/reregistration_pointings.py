"""From turned images to pointings: neighbours in time that look the same way.

A camera rests, is moved, rests again. Images in order of time join the pointing before them as long
as they look the way it does, within the movement alarm and what the images themselves leave open;
the first that does not begins a new one. A camera that comes back to where it looked begins a new
pointing too, because a viewport is valid for one stretch of time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.reregistration_rotation import rotation_angle_deg

# How many standard deviations two images of one pointing may differ by beyond the alarm.
DOUBT = 2.0
# The misses of one picture are not independent (lens, weather): its own covariance flatters.
FLOOR_DEG = 0.005


@dataclass(frozen=True, eq=False)
class PointingEstimate:
    """Images (their places in the given order) with one rotation and its covariance (3, 3), rad^2.

    The covariance is of the turn about the axes of the pointing's camera.
    """

    members: tuple[int, ...]
    R_from_reference: FloatArray
    covariance: FloatArray

    @property
    def angle_deg(self) -> float:
        """How far it is turned against the reference, degrees."""
        return rotation_angle_deg(self.R_from_reference)


def group_pointings(
    rotations: Sequence[FloatArray], covariances: Sequence[FloatArray], same_deg: float
) -> list[PointingEstimate]:
    """Group images in order of time by where they look.

    `rotations` (3, 3) turn the reference's camera frame into the image's; `same_deg` is the
    largest difference within a pointing.
    """
    pointings: list[PointingEstimate] = []
    for index, (R, covariance) in enumerate(zip(rotations, covariances, strict=True)):
        single = PointingEstimate((index,), R, covariance + np.radians(FLOOR_DEG) ** 2 * np.eye(3))
        if pointings and _is_same(pointings[-1], single, same_deg):
            pointings[-1] = _joined(pointings[-1], single)
        else:
            pointings.append(single)
    return pointings


def _is_same(pointing: PointingEstimate, single: PointingEstimate, same_deg: float) -> bool:
    apart_deg = rotation_angle_deg(single.R_from_reference @ pointing.R_from_reference.T)
    open_rad = np.sqrt(np.trace(pointing.covariance) + np.trace(single.covariance))
    return apart_deg <= max(same_deg, DOUBT * float(np.degrees(open_rad)))


def _joined(pointing: PointingEstimate, single: PointingEstimate) -> PointingEstimate:
    """Weigh the two by their information; the rotation moves along the turn between them."""
    import cv2  # noqa: PLC0415 - the web process reads results without it

    information = np.linalg.inv(pointing.covariance), np.linalg.inv(single.covariance)
    covariance = np.linalg.inv(information[0] + information[1])
    turn, _ = cv2.Rodrigues(single.R_from_reference @ pointing.R_from_reference.T)
    step, _ = cv2.Rodrigues(covariance @ information[1] @ np.asarray(turn, dtype=np.float64))
    return PointingEstimate(
        (*pointing.members, *single.members),
        np.asarray(step, dtype=np.float64) @ pointing.R_from_reference,
        covariance,
    )
