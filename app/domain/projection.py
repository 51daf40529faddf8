"""Projection with its derivatives, for many cameras at once.

What a fit needs of a camera: where each point appears and how that changes with each unknown. The
unknowns of a step are, in this order: a small rotation of the camera frame (3, rad), the camera's
centre (3, m in the world frame), the logarithm of the focal lengths, and k1.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics

UNKNOWNS = 8
_RADII = np.linspace(0.125, 1, 8)  # where the lens is asked whether it still grows
_TINY = 1e-24  # squared angle below which the series' first terms are exact


@dataclass(frozen=True, eq=False)
class Cameras:
    """B cameras with one principal point: R (B, 3, 3), centres (B, 3), focal (B, 2), lens (B, 5).

    `principal_px` is (2,).
    """

    R: FloatArray
    centers: FloatArray
    focal_px: FloatArray
    distortion: FloatArray
    principal_px: FloatArray

    @classmethod
    def copies(cls, camera: Camera, count: int) -> "Cameras":
        """Repeat one camera."""
        intrinsics = camera.intrinsics
        return cls(
            np.tile(camera.R_cam_from_world, (count, 1, 1)),
            np.tile(camera.center_in_world, (count, 1)),
            np.tile(intrinsics.focal_px, (count, 1)),
            np.tile(intrinsics.distortion, (count, 1)),
            intrinsics.principal_point_px,
        )

    def __len__(self) -> int:
        return len(self.R)

    def camera(self, index: int, image: Intrinsics) -> Camera:
        """Return one of them, with the image size of `image`."""
        K = np.eye(3)
        K[[0, 1], [0, 1]], K[:2, 2] = self.focal_px[index], self.principal_px
        lens = Intrinsics(image.width_px, image.height_px, K, self.distortion[index])
        return Camera(lens, self.R[index], self.centers[index])

    def moved(self, steps: FloatArray) -> "Cameras":
        """Apply steps (B, 6) of the pose or (B, 8) of all unknowns."""
        focal, distortion = self.focal_px, self.distortion
        if steps.shape[1] == UNKNOWNS:
            focal = focal * np.exp(np.clip(steps[:, 6], -5, 5))[:, None]
            distortion = distortion.copy()
            distortion[:, 0] += steps[:, 7]
        R = rotations(steps[:, :3]) @ self.R
        return Cameras(R, self.centers + steps[:, 3:6], focal, distortion, self.principal_px)

    def chosen(self, accepted: npt.NDArray[np.bool_], other: "Cameras") -> "Cameras":
        """Keep those where `accepted` (B,) holds, take the other ones elsewhere."""
        one, two = accepted[:, None], accepted[:, None, None]
        return Cameras(
            np.where(two, self.R, other.R),
            np.where(one, self.centers, other.centers),
            np.where(one, self.focal_px, other.focal_px),
            np.where(one, self.distortion, other.distortion),
            self.principal_px,
        )

    def project(self, points_in_world: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (B, n, 2) of points (n, 3), NaN where there are none; derivatives (B, n, 2, 8)."""
        from_center = points_in_world - self.centers[:, None, :]
        in_cam = from_center @ np.swapaxes(self.R, 1, 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse_z = 1 / in_cam[:, :, 2]
            x, y = in_cam[:, :, 0] * inverse_z, in_cam[:, :, 1] * inverse_z
            shown, by_ideal = _lens(self.distortion, x, y)
            valid = (in_cam[:, :, 2] > 0) & _one_to_one(self.distortion, x * x + y * y, by_ideal)
            focal = self.focal_px[:, None, :]
            offsets = shown * focal
            by_cam = _by_camera_point(x, y, inverse_z, by_ideal * focal[:, :, :, None])
            J: FloatArray = np.empty((*x.shape, 2, UNKNOWNS))
            # X_cam = exp(omega) R (X - C): by omega it is -[X_cam]_x, by C it is -R.
            J[..., :3] = np.cross(in_cam[:, :, None, :], by_cam)
            J[..., 3:6] = -by_cam @ self.R[:, None]
            J[..., 6] = offsets
            J[..., 7] = focal * np.stack([x, y], axis=-1) * (x * x + y * y)[:, :, None]
        pixels = offsets + self.principal_px
        pixels[~valid], J[~valid] = np.nan, 0.0
        return pixels, J


def projection_jacobian(camera: Camera, points_in_world: FloatArray) -> FloatArray:
    """Differentiate the pixels of points (n, 3) by the eight unknowns, (n, 2, 8)."""
    _, J = Cameras.copies(camera, 1).project(np.asarray(points_in_world, dtype=np.float64))
    by_unknowns: FloatArray = J[0]
    return by_unknowns


def rotations(rotvecs: FloatArray) -> FloatArray:
    """Rotation matrices (B, 3, 3) of Rodrigues vectors (B, 3)."""
    squared = np.einsum("bi,bi->b", rotvecs, rotvecs)
    angle = np.sqrt(squared)
    small = squared < _TINY
    divisor = np.where(small, 1.0, angle)
    sine = np.where(small, 1.0, np.sin(angle) / divisor)
    # 1 - cos, without losing the digits of small angles
    cosine = np.where(small, 0.5, 2 * (np.sin(angle / 2) / divisor) ** 2)
    cross: FloatArray = np.zeros((len(rotvecs), 3, 3))
    x, y, z = rotvecs.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross[:, 1, 0], cross[:, 2, 0], cross[:, 2, 1] = z, -y, x
    turned: FloatArray = (
        np.eye(3) + sine[:, None, None] * cross + cosine[:, None, None] * (cross @ cross)
    )
    return turned


def _lens(distortion: FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distorted (B, n, 2) of ideal points (B, n), and derivatives (B, n, 2, 2): OpenCV's model."""
    k1, k2, p1, p2, k3 = (term[:, None] for term in distortion.T)
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))  # d radial / dx = slope * x
    shown = np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )
    by_ideal: FloatArray = np.empty((*x.shape, 2, 2))
    by_ideal[..., 0, 0] = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x
    by_ideal[..., 0, 1] = by_ideal[..., 1, 0] = slope * x * y + 2 * (p1 * x + p2 * y)
    by_ideal[..., 1, 1] = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x
    return shown, by_ideal


def _one_to_one(
    distortion: FloatArray, r2: FloatArray, by_ideal: FloatArray
) -> npt.NDArray[np.bool_]:
    """Whether the radial polynomial grows from the centre out to each point (B, n)."""
    k1, k2, _, _, k3 = (term[:, None, None] for term in distortion.T)
    s = r2[:, :, None] * _RADII
    grows = (1 + s * (3 * k1 + s * (5 * k2 + s * 7 * k3)) > 0).all(axis=-1)
    determinant = by_ideal[..., 0, 0] * by_ideal[..., 1, 1] - by_ideal[..., 0, 1] ** 2
    return np.asarray(grows & (determinant > 0))


def _by_camera_point(
    x: FloatArray, y: FloatArray, inverse_z: FloatArray, by_ideal: FloatArray
) -> FloatArray:
    """Differentiate pixels, (B, n, 2, 3), by the point in the camera frame."""
    by_cam: FloatArray = np.empty((*x.shape, 2, 3))
    by_cam[..., :2] = by_ideal * inverse_z[..., None, None]
    along = by_ideal[..., 0] * x[..., None] + by_ideal[..., 1] * y[..., None]
    by_cam[..., 2] = -along * inverse_z[..., None]
    return by_cam
