"""Where the camera stands: perspective-n-point, refined until nothing moves any more.

A closed solution (SQPNP) inside RANSAC finds the camera in spite of wrong keypoints; a
Levenberg-Marquardt refinement then minimises the reprojection error. Numbers stay small: the
closed solver sees points relative to their centroid, in metres, because raw geocentric coordinates
lose hundreds of kilometres. With enough points the focal length and k1 are refined too, held by
priors: a focal length 5 % off costs more than all clicking errors together.

The unknowns of a step, in this order: a small rotation of the camera frame (3, rad), the camera's
centre (3, m in the world frame), then, if refined, the logarithm of the focal lengths and k1.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.keypoints import Keypoints
from app.domain.least_squares import minimised
from app.domain.projection import UNKNOWNS, Cameras, projection_jacobian
from app.domain.rotations import matrix_from_rotvec

_SETTLED_PX = 1e-10  # what the last step may still move: far below anything a pixel can mean
_AT_ONCE = 20_000  # keypoints times fits that are held in memory together


@dataclass(frozen=True, slots=True)
class Priors:
    """What is known before: sigmas of a keypoint's pixel, of the relative focal length, of k1."""

    pixel_px: float = 2.0
    focal: float = 0.03
    k1: float = 0.3


def residuals_px(camera: Camera, keypoints: Keypoints) -> FloatArray:
    """Projected minus observed pixels (n, 2); infinite where a point has no projection."""
    residuals = camera.project(keypoints.points_in_world) - keypoints.pixels_px
    return np.where(np.isnan(residuals), np.inf, residuals)


def distances_px(camera: Camera, keypoints: Keypoints) -> FloatArray:
    """Reprojection errors (n,): how far each keypoint lies from its projection."""
    return np.asarray(np.linalg.norm(residuals_px(camera, keypoints), axis=1), dtype=np.float64)


def first_camera(
    intrinsics: Intrinsics, keypoints: Keypoints, threshold_px: float
) -> Camera | None:
    """Find a camera by SQPNP, with RANSAC against wrong keypoints; None when there is no solution.

    Of RANSAC's camera and that of all points the one is taken which more keypoints agree with.
    """
    found = (
        _closed(intrinsics, keypoints, threshold_px=threshold_px),
        closed_camera(intrinsics, keypoints),
    )
    return max(
        (camera for camera in found if camera is not None),
        key=lambda camera: int((distances_px(camera, keypoints) <= threshold_px).sum()),
        default=None,
    )


def closed_camera(intrinsics: Intrinsics, keypoints: Keypoints) -> Camera | None:
    """Find the camera of all keypoints by SQPNP alone; None when there is no solution."""
    return _closed(intrinsics, keypoints, threshold_px=None)


def _closed(
    intrinsics: Intrinsics, keypoints: Keypoints, threshold_px: float | None
) -> Camera | None:
    """Solve by SQPNP, inside RANSAC where there is a threshold."""
    import cv2  # noqa: PLC0415 - keeps the web process small

    centroid = keypoints.points_in_world.mean(axis=0)
    points = np.ascontiguousarray(keypoints.points_in_world - centroid)
    pixels = np.ascontiguousarray(keypoints.pixels_px)
    lens = (intrinsics.K.copy(), intrinsics.distortion.copy())
    try:
        if threshold_px is None:
            found, rvec, tvec = cv2.solvePnP(points, pixels, *lens, flags=cv2.SOLVEPNP_SQPNP)
        else:
            found, rvec, tvec, _ = cv2.solvePnPRansac(
                points,
                pixels,
                *lens,
                iterationsCount=1000,
                reprojectionError=threshold_px,
                confidence=0.9999,
                flags=cv2.SOLVEPNP_SQPNP,
            )
    except cv2.error:  # OpenCV raises on degenerate points instead of saying "not found"
        return None
    if not found or not np.isfinite(rvec).all() or not np.isfinite(tvec).all():
        return None
    R = matrix_from_rotvec(np.ravel(rvec))
    return Camera(intrinsics, R, centroid - R.T @ np.ravel(tvec))


def refine(
    start: Camera,
    keypoints: Keypoints,
    priors: Priors,
    refined_from: Intrinsics | None = None,
) -> Camera:
    """Move the camera downhill to the least squared reprojection error (Levenberg-Marquardt).

    With `refined_from` the focal length and k1 move too, held by the priors around those
    intrinsics; without it they stay. A start with points behind the camera comes back as it is.
    """
    used = np.ones((1, len(keypoints)), dtype=np.bool_)
    return _refined(start, keypoints, used, priors, refined_from)[0]


def refine_without_each(
    start: Camera,
    keypoints: Keypoints,
    used: npt.NDArray[np.bool_],
    priors: Priors,
    refined_from: Intrinsics | None = None,
) -> list[Camera]:
    """Refine once without each of the `used` (n,) keypoints in turn, in their order."""
    left_out = np.flatnonzero(used)
    size = max(1, _AT_ONCE // max(len(keypoints), 1))
    cameras: list[Camera] = []
    for begin in range(0, len(left_out), size):
        part = left_out[begin : begin + size]
        chosen = np.tile(used, (len(part), 1))
        chosen[np.arange(len(part)), part] = False
        cameras += _refined(start, keypoints, chosen, priors, refined_from)
    return cameras


def parameter_covariance(
    camera: Camera, keypoints: Keypoints, priors: Priors, refined_from: Intrinsics | None
) -> FloatArray:
    """Covariance (6, 6), or (8, 8) with refined intrinsics, of the unknowns in a step's order.

    From J^T J at the solution, scaled by the pixel variance that the residuals themselves show.
    """
    problems = _Fits(keypoints, np.ones((1, len(keypoints)), dtype=np.bool_), priors, refined_from)
    (measured,), (J,) = problems.linearised(Cameras.copies(camera, 1))
    count = 2 * len(keypoints)
    freedom = count - 6 - (0 if refined_from is None else 2)
    variance = float(measured[:count] @ measured[:count]) / max(freedom, 1)
    # The priors keep their own sigmas: only the pixels' share is rescaled.
    weights = np.ones(len(measured))
    weights[:count] = 1 / max(variance, 1e-12)
    return np.asarray(np.linalg.inv(J.T @ (weights[:, None] * J)), dtype=np.float64)


def condition_number(camera: Camera, keypoints: Keypoints) -> float:
    """Condition number of the pose part of J: pixels by radians and metres.

    Thousands for usual keypoints; above a million the camera is off by many tens of metres.
    """
    J = projection_jacobian(camera, keypoints.points_in_world)[:, :, :6].reshape(-1, 6)
    return float(np.linalg.cond(J))


@dataclass(frozen=True, eq=False)
class _Fits:
    """One fit for each row of `used` (B, n): the same keypoints, some left out of each."""

    keypoints: Keypoints
    used: npt.NDArray[np.bool_]
    priors: Priors
    refined_from: Intrinsics | None

    def linearised(self, cameras: Cameras) -> tuple[FloatArray, FloatArray]:
        """All residuals (B, m) in units of their sigma, and their derivatives (B, m, 6 or 8)."""
        pixels, J = cameras.project(self.keypoints.points_in_world)
        count = len(cameras)
        residuals = (pixels - self.keypoints.pixels_px) / self.priors.pixel_px
        residuals[np.isnan(residuals)] = np.inf
        residuals[~self.used], J[~self.used] = 0.0, 0.0
        residuals, J = residuals.reshape(count, -1), J.reshape(count, -1, UNKNOWNS)
        J /= self.priors.pixel_px
        if self.refined_from is None:
            return residuals, J[:, :, :6]
        log_focal = np.log(cameras.focal_px[:, 0] / self.refined_from.K[0, 0])
        k1 = cameras.distortion[:, 0] - self.refined_from.distortion[0]
        held = np.zeros((count, 2, UNKNOWNS))
        held[:, 0, 6], held[:, 1, 7] = 1 / self.priors.focal, 1 / self.priors.k1
        known = np.column_stack([log_focal / self.priors.focal, k1 / self.priors.k1])
        return np.concatenate([residuals, known], axis=1), np.concatenate([J, held], axis=1)

    def moved(self, cameras: Cameras, steps: FloatArray) -> Cameras:
        """Apply a step to each camera."""
        return cameras.moved(steps)

    def chosen(self, accepted: npt.NDArray[np.bool_], new: Cameras, old: Cameras) -> Cameras:
        """Take the new cameras where they are better."""
        return new.chosen(accepted, old)


def _refined(
    start: Camera,
    keypoints: Keypoints,
    used: npt.NDArray[np.bool_],
    priors: Priors,
    refined_from: Intrinsics | None,
) -> list[Camera]:
    fits = _Fits(keypoints, used, priors, refined_from)
    cameras = Cameras.copies(start, len(used))
    found = minimised(fits, cameras, _SETTLED_PX / priors.pixel_px)
    return [found.camera(index, start.intrinsics) for index in range(len(found))]
