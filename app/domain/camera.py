"""The pinhole camera with lens distortion: between metres of the world and pixels of the image.

Paper, equation camera_projection: `x = K Pi cTw X`. The camera frame is OpenCV's (x right, y down,
z forward), and `X_cam = R_cam_from_world (X_world - center_in_world)`. Keeping the centre rather
than the translation keeps geocentric coordinates accurate: six million metres cancel before the
rotation, not after it. Pixel (0, 0) is the centre of the first pixel, so the image reaches from
-0.5 to width - 0.5.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from app.domain.arrays import BoolArray, FloatArray, frozen_array
from app.domain.distortion import distort, undistort

_STEEPEST = 1e6  # x / z: all that is ahead


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """What belongs to the camera body and lens: image size, K (3, 3) and distortion (5,).

    `distortion` is k1, k2, p1, p2, k3 (OpenCV's order), none by default. Raises ValueError naming
    the field for an empty image, a focal length that is not positive, skew, or non-finite numbers.
    """

    width_px: int
    height_px: int
    K: FloatArray
    distortion: FloatArray = field(default_factory=lambda: np.zeros(5))

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", frozen_array("K", self.K, (3, 3)))
        object.__setattr__(self, "distortion", frozen_array("distortion", self.distortion, (5,)))
        if self.width_px < 1 or self.height_px < 1:
            raise ValueError("width_px and height_px must be at least 1")
        if self.K[0, 0] <= 0 or self.K[1, 1] <= 0:
            raise ValueError("K must have positive focal lengths in K[0][0] and K[1][1]")
        if self.K[0, 1] != 0 or self.K[1, 0] != 0 or (self.K[2] != (0, 0, 1)).any():
            raise ValueError("K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]: no skew")

    @cached_property
    def focal_px(self) -> FloatArray:
        """Focal lengths (fx, fy), pixels."""
        return frozen_array("focal_px", [self.K[0, 0], self.K[1, 1]], (2,))

    @cached_property
    def principal_point_px(self) -> FloatArray:
        """Principal point (cx, cy), pixels."""
        return frozen_array("principal_point_px", [self.K[0, 2], self.K[1, 2]], (2,))

    @cached_property
    def side_slopes(self) -> tuple[float, float]:
        """Least and greatest x / z that the picture's sides show; a million where unknown."""
        rows = np.linspace(-0.5, self.height_px - 0.5, 9)
        found = []
        for column, worst in ((-0.5, -_STEEPEST), (self.width_px - 0.5, _STEEPEST)):
            border = np.column_stack([np.full_like(rows, column), rows])
            shown = (border - self.principal_point_px) / self.focal_px
            x = undistort(self.distortion, shown)[:, 0]
            extreme = x.min() if worst < 0 else x.max()
            found.append(float(worst if np.isnan(x).any() else extreme))
        return found[0], found[1]

    @cached_property
    def is_distorted(self) -> bool:
        """Whether the lens bends lines."""
        return bool(self.distortion.any())


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera with its place in a world frame (ECEF or ENU, metres).

    `covariance` (6, 6) says how unsure its registration is, in a site's ENU frame, as
    `Registration.covariance`; None where nobody knows. Raises ValueError when `R_cam_from_world`
    (3, 3) is no rotation.
    """

    intrinsics: Intrinsics
    R_cam_from_world: FloatArray
    center_in_world: FloatArray
    covariance: FloatArray | None = None

    def __post_init__(self) -> None:
        R = frozen_array("R_cam_from_world", self.R_cam_from_world, (3, 3))
        # Published matrices are printed with few digits; 1e-6 is 0.01 px at usual focal lengths.
        if np.abs(R @ R.T - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0:
            raise ValueError(
                "R_cam_from_world must be a rotation: orthonormal rows and determinant +1"
            )
        object.__setattr__(self, "R_cam_from_world", R)
        center = frozen_array("center_in_world", self.center_in_world, (3,))
        object.__setattr__(self, "center_in_world", center)
        if self.covariance is not None:
            covariance = frozen_array("covariance", self.covariance, (6, 6))
            object.__setattr__(self, "covariance", covariance)

    @property
    def t_cam_from_world(self) -> FloatArray:
        """Translation t of `X_cam = R X_world + t`, metres, shape (3,)."""
        return -self.R_cam_from_world @ self.center_in_world

    def to_cam(self, points_in_world: npt.ArrayLike) -> FloatArray:
        """World points (n, 3) in the camera frame, (n, 3) metres."""
        points = np.asarray(points_in_world, dtype=np.float64).reshape(-1, 3)
        return (points - self.center_in_world) @ self.R_cam_from_world.T

    def project(self, points_in_world: npt.ArrayLike) -> FloatArray:
        """Pixels (n, 2) of world points (n, 3).

        A row is NaN when its point lies in or behind the camera's plane, or so far aside that the
        distortion is no longer one-to-one. Pixels outside the image are given as they are.
        """
        return self.shown(self.to_cam(points_in_world).T).T

    def shown(self, in_cam_m: FloatArray) -> FloatArray:
        """Pixels (2, ...) of points (3, ...) of the camera frame, NaN as `project` has it.

        Coordinates come first: for many points that is several times as fast as row by row.
        """
        intrinsics = self.intrinsics
        ideal = in_cam_m[:2] / np.where(in_cam_m[2] > 0, in_cam_m[2], np.nan)
        if intrinsics.is_distorted:
            rows = distort(intrinsics.distortion, ideal.reshape(2, -1).T)
            ideal = rows.T.reshape(ideal.shape)
        each = (2, *[1] * (ideal.ndim - 1))
        pixels = ideal * intrinsics.focal_px.reshape(each)
        pixels += intrinsics.principal_point_px.reshape(each)
        return pixels

    def px_per_m(self, points_in_world: npt.ArrayLike) -> FloatArray:
        """Return how many pixels a metre across is at world points (n, 3), (n,).

        Points nearer than a metre, or behind, count as a metre away.
        """
        ahead_m = self.to_cam(points_in_world)[:, 2]
        scale: FloatArray = self.intrinsics.focal_px[0] / np.maximum(ahead_m, 1.0)
        return scale

    def may_show(self, points_in_world: npt.ArrayLike, radius_m: float) -> BoolArray:
        """Whether balls around world points (n, 3) may reach into the picture's width, (n,).

        Quick, and never False for one that does: for leaving out most of what is elsewhere.
        """
        aside_m, _, ahead_m = self.to_cam(points_in_world).T
        left, right = self.intrinsics.side_slopes
        # Of a ball's points, those farther ahead may be seen where a side opens outwards.
        leftmost_m = left * ahead_m - abs(left) * radius_m
        rightmost_m = right * ahead_m + abs(right) * radius_m
        inside: BoolArray = (
            (ahead_m + radius_m > 0)
            & (aside_m + radius_m >= leftmost_m)
            & (aside_m - radius_m <= rightmost_m)
        )
        return inside

    def rays(self, pixels_px: npt.ArrayLike) -> FloatArray:
        """Give the lines of sight of pixels (n, 2) as unit directions (n, 3) in the world frame.

        The paper's `pld` (projection line direction), undistorted. A row is NaN when no point in
        front of the camera is shown at that pixel.
        """
        pixels = np.asarray(pixels_px, dtype=np.float64).reshape(-1, 2)
        shown = (pixels - self.intrinsics.principal_point_px) / self.intrinsics.focal_px
        in_cam = np.ones((len(shown), 3))
        in_cam[:, :2] = undistort(self.intrinsics.distortion, shown)
        in_cam /= np.sqrt((in_cam * in_cam).sum(axis=1, keepdims=True))
        return in_cam @ self.R_cam_from_world
