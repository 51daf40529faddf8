"""Homographies between a plane of the world and the image, for comparison with the camera.

The paper (Homography): landmarks are projected onto an interim plane, `k_2d = A^T k_3d`, and one
matrix H maps the plane to the image, `x_1 = H x_2`. Two planes are compared: the tangent plane of
the water surface, and the plane of the landmarks' two first principal axes (PCA). Whatever height
the projection throws away comes back as error: it is shown beside PnP to say why PnP is used.
"""

from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.keypoints import Keypoints


@dataclass(frozen=True, eq=False)
class Homography:
    """H (3, 3), from metres in the interim plane to pixels.

    Plane coordinates are `A^T (X - origin)` with the plane's two unit vectors as columns of
    `A` (3, 2) and `origin_in_world` (3,); the origin only keeps the numbers small.
    """

    A: FloatArray
    origin_in_world: FloatArray
    H: FloatArray

    def project(self, points_in_world: FloatArray) -> FloatArray:
        """Pixels (n, 2) of world points (n, 3), NaN at the plane's horizon and beyond it."""
        in_plane = (points_in_world - self.origin_in_world) @ self.A
        homogeneous = np.column_stack([in_plane, np.ones(len(in_plane))]) @ self.H.T
        # OpenCV scales H so that the origin, here the landmarks' centroid, has a 1 there.
        ahead = homogeneous[:, 2] > 0
        pixels: FloatArray = np.full((len(in_plane), 2), np.nan)
        pixels[ahead] = homogeneous[ahead, :2] / homogeneous[ahead, 2:]
        return pixels


def water_axes() -> FloatArray:
    """Span the tangent plane of the water in an ENU frame: A (3, 2) of east and north."""
    return np.eye(3)[:, :2]


def principal_axes(points_in_world: FloatArray) -> FloatArray:
    """Span the plane along which points (n, 3) vary most: A (3, 2) of two axes."""
    _, _, axes = np.linalg.svd(points_in_world - points_in_world.mean(axis=0))
    return np.asarray(axes[:2].T, dtype=np.float64)


def fit_homography(A: FloatArray, keypoints: Keypoints) -> Homography | None:
    """Fit H to the least squared reprojection error; None where the points do not determine it."""
    import cv2  # noqa: PLC0415 - keeps the web process small

    origin = keypoints.points_in_world.mean(axis=0)
    in_plane = (keypoints.points_in_world - origin) @ A
    H, _ = cv2.findHomography(in_plane, keypoints.pixels_px, 0)
    if H is None or not np.isfinite(H).all():
        return None
    return Homography(A, origin, np.asarray(H, dtype=np.float64))
