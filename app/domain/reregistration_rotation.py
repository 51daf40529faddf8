"""The one rotation between two pictures from the same place, found among many wrong pairs.

A camera that turned about its centre turns all lines of sight alike, however far the scene: three
numbers explain every pair, `ray_b = R ray_a`. Two pairs are enough to propose a rotation, and a
proposal is only worth trying when the angle between the two rays is the same in both pictures;
that throws away most wrong pairs before anything is counted. A free homography, with eight numbers,
would bend itself around the wrong ones.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

DRAWS = 100_000
MOST_PROPOSALS = 1_500
LEAST_BASE_RAD = 0.01  # rays closer together say nothing about the roll
POLISHING_ROUNDS = 12


@dataclass(frozen=True, eq=False)
class RotationFit:
    """A rotation (3, 3), the pairs (n,) that follow it, and each one's distance from it (n,), rad.

    `covariance` (3, 3) is of the turn about the axes of frame b, rad^2: R = exp([omega]) R_found.
    """

    R_b_from_a: FloatArray
    inliers: npt.NDArray[np.bool_]
    distances_rad: FloatArray
    covariance: FloatArray


def fit_rotation(
    rays_a: FloatArray,
    rays_b: FloatArray,
    weights: FloatArray,
    tolerance_rad: float,
    largest_angle_rad: float,
) -> RotationFit | None:
    """Find the rotation that most pairs of unit rays (n, 3) follow to within the tolerance.

    `weights` (n,) say how often a pair is drawn. None where no two pairs agree. The draws come
    from a fixed seed: the same pairs give the same rotation.
    """
    proposals = _proposals(rays_a, rays_b, weights, tolerance_rad)
    if len(proposals) == 0:
        return None
    angles = np.arccos(np.clip((np.trace(proposals, axis1=1, axis2=2) - 1) / 2, -1, 1))
    proposals = proposals[angles <= largest_angle_rad]
    if len(proposals) == 0:
        return None
    R = proposals[_support(proposals, rays_a, rays_b, tolerance_rad).argmax()]
    return polish_rotation(R, rays_a, rays_b, tolerance_rad)


def polish_rotation(
    R: FloatArray, rays_a: FloatArray, rays_b: FloatArray, tolerance_rad: float
) -> RotationFit | None:
    """Fit a rotation anew to the pairs of rays (n, 3) that follow it; None where fewer than two do.

    Near pairs weigh more (Tukey's biweight), so that the tolerance's edge does not matter.
    """
    for _ in range(POLISHING_ROUNDS):
        distances = np.linalg.norm(rays_a @ R.T - rays_b, axis=1)
        weights = np.maximum(0, 1 - (distances / tolerance_rad) ** 2) ** 2
        if np.count_nonzero(weights) < 2:
            return None
        R = aligned(rays_a, rays_b, weights)
    distances = np.linalg.norm(rays_a @ R.T - rays_b, axis=1)
    inliers = distances < tolerance_rad
    if inliers.sum() < 2:
        return None
    return RotationFit(R, inliers, distances, _covariance(rays_b[inliers], distances[inliers]))


def aligned(rays_a: FloatArray, rays_b: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) that turns rays a onto rays b best (Kabsch, 1976)."""
    U, _, Vt = np.linalg.svd((rays_b * weights[:, None]).T @ rays_a)
    R: FloatArray = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    return R


def rotation_angle_deg(R: FloatArray) -> float:
    """Return by how much a rotation (3, 3) turns, degrees; exact for tiny angles too."""
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return float(np.degrees(np.arctan2(sine, (np.trace(R) - 1) / 2)))


def _proposals(
    rays_a: FloatArray, rays_b: FloatArray, weights: FloatArray, tolerance_rad: float
) -> FloatArray:
    if len(rays_a) < 2:
        return np.empty((0, 3, 3))
    generator = np.random.default_rng(0)
    shares = np.cumsum(weights) / weights.sum()
    drawn = np.searchsorted(shares, generator.random((2, DRAWS)))
    first, second = np.minimum(drawn, len(rays_a) - 1)
    apart_a = np.linalg.norm(rays_a[first] - rays_a[second], axis=1)
    apart_b = np.linalg.norm(rays_b[first] - rays_b[second], axis=1)
    alike = (np.abs(apart_a - apart_b) < tolerance_rad) & (apart_a > LEAST_BASE_RAD)
    chosen = np.flatnonzero(alike)[:MOST_PROPOSALS]
    return _frames(rays_b[first[chosen]], rays_b[second[chosen]]) @ np.swapaxes(
        _frames(rays_a[first[chosen]], rays_a[second[chosen]]), 1, 2
    )


def _frames(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return right-handed frames (n, 3, 3), axes in columns: the middle ray, aside, across."""
    middle = first + second
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    across = np.cross(first, second)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    return np.stack([middle, np.cross(across, middle), across], axis=2)


def _support(
    proposals: FloatArray, rays_a: FloatArray, rays_b: FloatArray, tolerance_rad: float
) -> FloatArray:
    """Return how well each proposal (p, 3, 3) is supported: near pairs count more, far ones 0."""
    support = np.empty(len(proposals))
    a, b = rays_a.astype(np.float32), rays_b.astype(np.float32)
    for start in range(0, len(proposals), 256):
        part = proposals[start : start + 256].astype(np.float32)
        miss = np.einsum("pij,nj->pni", part, a, optimize=True) - b
        squared = (miss * miss).sum(axis=2) / np.float32(tolerance_rad**2)
        support[start : start + 256] = np.maximum(0, 1 - squared).sum(axis=1)
    return support


def _covariance(rays: FloatArray, distances_rad: FloatArray) -> FloatArray:
    """Return the rotation's covariance: each ray measures two of three turns, with the same noise.

    The noise is judged by the misses themselves; n pairs have 2 n - 3 degrees of freedom.
    """
    variance = (distances_rad**2).sum() / max(2 * len(rays) - 3, 1)
    information = len(rays) * np.eye(3) - rays.T @ rays
    covariance: FloatArray = variance * np.linalg.pinv(information)
    return covariance
