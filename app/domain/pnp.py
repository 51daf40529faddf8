"""Where the camera stands: perspective-n-point, refined to the last hundredth of a pixel.

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

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.distortion import distortion_jacobian
from app.domain.keypoints import Keypoints
from app.domain.rotations import matrix_from_rotvec

_MAXIMUM_STEPS = 60
_CONVERGED = 1e-10  # relative gain of a step: far below anything a keypoint can mean
_EXACT = 1e-12  # squared sigmas: keypoints without any error leave nothing to gain
_GIVING_UP = 1e12  # damping at which no step downhill is left


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
    import cv2  # noqa: PLC0415 - keeps the web process small

    centroid = keypoints.points_in_world.mean(axis=0)
    points = np.ascontiguousarray(keypoints.points_in_world - centroid)
    pixels = np.ascontiguousarray(keypoints.pixels_px)
    K, distortion = intrinsics.K.copy(), intrinsics.distortion.copy()
    solutions = []
    try:
        found, rvec, tvec, _ = cv2.solvePnPRansac(
            points,
            pixels,
            K,
            distortion,
            iterationsCount=1000,
            reprojectionError=threshold_px,
            confidence=0.9999,
            flags=cv2.SOLVEPNP_SQPNP,
        )
        if found:
            solutions.append((rvec, tvec))
        found, rvec, tvec = cv2.solvePnP(points, pixels, K, distortion, flags=cv2.SOLVEPNP_SQPNP)
        if found:
            solutions.append((rvec, tvec))
    except cv2.error:  # OpenCV raises on degenerate points instead of saying "not found"
        return None
    cameras = []
    for rvec, tvec in solutions:
        R = matrix_from_rotvec(np.ravel(rvec))
        cameras.append(Camera(intrinsics, R, centroid - R.T @ np.ravel(tvec)))
    return max(
        cameras,
        key=lambda camera: int((distances_px(camera, keypoints) <= threshold_px).sum()),
        default=None,
    )


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
    camera = start
    residuals, J = _linearised(camera, keypoints, priors, refined_from)
    cost, damping = float(residuals @ residuals), 1e-3
    if not np.isfinite(cost):
        return start
    for _ in range(_MAXIMUM_STEPS):
        normal, gradient = J.T @ J, J.T @ residuals
        scale = np.diag(np.diag(normal)) + 1e-15 * np.eye(len(normal))
        step = np.linalg.solve(normal + damping * scale, -gradient).astype(np.float64)
        moved = _stepped(camera, step)
        moved_residuals, moved_J = _linearised(moved, keypoints, priors, refined_from)
        moved_cost = float(moved_residuals @ moved_residuals)
        if moved_cost > cost or not np.isfinite(moved_cost):
            damping *= 10
            if damping > _GIVING_UP:
                break
            continue
        settled = cost - moved_cost <= _CONVERGED * cost + _EXACT
        camera, residuals, J, cost = moved, moved_residuals, moved_J, moved_cost
        damping = max(damping / 10, 1e-12)
        if settled:
            break
    return camera


def parameter_covariance(
    camera: Camera, keypoints: Keypoints, priors: Priors, refined_from: Intrinsics | None
) -> FloatArray:
    """Covariance (6, 6), or (8, 8) with refined intrinsics, of the unknowns in a step's order.

    From J^T J at the solution, scaled by the pixel variance that the residuals themselves show.
    """
    measured, J = _linearised(camera, keypoints, priors, refined_from)
    freedom = 2 * len(keypoints) - 6 - (0 if refined_from is None else 2)
    pixels = measured[: 2 * len(keypoints)]
    variance = float(pixels @ pixels) / max(freedom, 1)
    # The priors keep their own sigmas: only the pixels' share is rescaled.
    weights = np.ones(len(measured))
    weights[: 2 * len(keypoints)] = 1 / max(variance, 1e-12)
    return np.asarray(np.linalg.inv(J.T @ (weights[:, None] * J)), dtype=np.float64)


def condition_number(camera: Camera, keypoints: Keypoints) -> float:
    """Condition number of the pose part of J: pixels by radians and metres.

    Thousands for usual keypoints; above a million the camera is off by many tens of metres.
    """
    J = projection_jacobian(camera, keypoints.points_in_world)[:, :, :6].reshape(-1, 6)
    return float(np.linalg.cond(J))


def projection_jacobian(camera: Camera, points_in_world: FloatArray) -> FloatArray:
    """Differentiate the pixels of points (n, 3) by the eight unknowns, (n, 2, 8)."""
    in_cam = camera.to_cam(points_in_world)
    x, y, z = in_cam.T
    ideal = in_cam[:, :2] / z[:, None]
    focal = camera.intrinsics.focal_px
    zero = np.zeros_like(z)
    normalising = np.stack(
        [
            np.column_stack([1 / z, zero, -x / z**2]),
            np.column_stack([zero, 1 / z, -y / z**2]),
        ],
        axis=1,
    )
    by_cam = (
        focal[:, None] * distortion_jacobian(camera.intrinsics.distortion, ideal)
    ) @ normalising
    # X_cam = exp(omega) R (X - C): by omega it is -[X_cam]_x, by C it is -R.
    turned = np.stack(
        [
            np.column_stack([zero, z, -y]),
            np.column_stack([-z, zero, x]),
            np.column_stack([y, -x, zero]),
        ],
        axis=1,
    )
    jacobian: FloatArray = np.empty((len(in_cam), 2, 8))
    jacobian[:, :, :3] = by_cam @ turned
    jacobian[:, :, 3:6] = by_cam @ -camera.R_cam_from_world
    pixels = camera.project(points_in_world)
    jacobian[:, :, 6] = pixels - camera.intrinsics.principal_point_px
    jacobian[:, :, 7] = focal * ideal * (ideal**2).sum(axis=1, keepdims=True)
    return jacobian


def _linearised(
    camera: Camera, keypoints: Keypoints, priors: Priors, refined_from: Intrinsics | None
) -> tuple[FloatArray, FloatArray]:
    """Give all residuals in units of their sigma, and their derivatives."""
    residuals = residuals_px(camera, keypoints).ravel() / priors.pixel_px
    J = projection_jacobian(camera, keypoints.points_in_world).reshape(-1, 8) / priors.pixel_px
    if refined_from is None:
        return residuals, J[:, :6]
    log_focal = np.log(camera.intrinsics.K[0, 0] / refined_from.K[0, 0])
    k1 = camera.intrinsics.distortion[0] - refined_from.distortion[0]
    held = np.zeros((2, 8))
    held[0, 6], held[1, 7] = 1 / priors.focal, 1 / priors.k1
    return (
        np.concatenate([residuals, [log_focal / priors.focal, k1 / priors.k1]]),
        np.vstack([J, held]),
    )


def _stepped(camera: Camera, step: FloatArray) -> Camera:
    """Apply a step of 6 or 8 unknowns."""
    intrinsics = camera.intrinsics
    if len(step) == 8:
        K, distortion = intrinsics.K.copy(), intrinsics.distortion.copy()
        K[[0, 1], [0, 1]] *= np.exp(step[6])
        distortion[0] += step[7]
        intrinsics = Intrinsics(intrinsics.width_px, intrinsics.height_px, K, distortion)
    return Camera(
        intrinsics,
        matrix_from_rotvec(step[:3]) @ camera.R_cam_from_world,
        camera.center_in_world + step[3:6],
    )
