"""Shadows: what the sun can see, and corners that the open sky hardly reaches.

Seen from the sun, whatever is lit is in front. So a mesh is filled once as a camera very far away
in the sun's direction would see it; a point is in the sun when nothing there is nearer. Corners,
eaves and bulwarks are dark under any sky: a pixel that lies deeper than those around it is taken
to be in such a corner, which is crude, quick and looks right.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array, FloatArray
from app.domain.camera import Camera, Intrinsics
from app.simulation.mesh import Mesh, Shade
from app.simulation.raster import Window, rasterise

_AWAY = 40.0  # the sun camera's distance in widths of what it covers: nearly parallel rays
_TAPS = ((-0.6, -0.3), (0.3, -0.6), (0.6, 0.3), (-0.3, 0.6))  # texels; blurs the shadow's edge


@dataclass(frozen=True, eq=False)
class SunView:
    """What the sun sees of a mesh: inverse depths (size, size), 1/m, from `camera`."""

    camera: Camera
    inverse_depth: Float32Array
    slack_m: float

    @staticmethod
    def of(
        mesh: Mesh, to_sun: FloatArray, middle: FloatArray, radius_m: float, size: int
    ) -> "SunView":
        """See a mesh within `radius_m` of a point from the sun, on `size` x `size` texels."""
        away_m = _AWAY * 2 * radius_m
        focal = away_m * size / (2 * radius_m)
        K = np.array([[focal, 0, (size - 1) / 2], [0, focal, (size - 1) / 2], [0, 0, 1.0]])
        right = np.cross(-to_sun, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(-to_sun, right), -to_sun])
        camera = Camera(Intrinsics(size, size, K), axes, middle + away_m * to_sun)
        seen = rasterise(camera, mesh, Window(0, 0, size, size, 1))
        return SunView(camera, seen.inverse_depth, 0.12 + 3.0 * radius_m / size)

    def lit(self, places: Shade) -> Shade:
        """Return how much of the sun reaches places (n, 3): 0 to 1."""
        in_cam = (places - self.camera.center_in_world) @ self.camera.R_cam_from_world.T
        K, size = self.camera.intrinsics.K, len(self.inverse_depth)
        column = in_cam[:, 0] / in_cam[:, 2] * K[0, 0] + K[0, 2]
        row = in_cam[:, 1] / in_cam[:, 2] * K[1, 1] + K[1, 2]
        nearest = 1 / (in_cam[:, 2] - self.slack_m)
        share = np.zeros(len(places), dtype=np.float32)
        for dx, dy in _TAPS:
            u, v = np.rint(column + dx).astype(np.int32), np.rint(row + dy).astype(np.int32)
            inside = (u >= 0) & (u < size) & (v >= 0) & (v < size)
            flat = np.where(inside, v * size + u, 0)
            share += (self.inverse_depth.ravel()[flat] <= nearest) | ~inside
        lit: Shade = share / np.float32(len(_TAPS))
        return lit


def openness(
    inverse_depth: Shade, mask: npt.NDArray[np.bool_], reach_px: int, depth_m: float
) -> Shade:
    """Return how open to the sky each sample (h, w) is, 0.5 to 1.

    Samples deeper than the mean of those within `reach_px` by `depth_m` are darkest; those far
    deeper belong to something else behind and are open.
    """
    kernel = (2 * reach_px + 1, 2 * reach_px + 1)
    weight = cv2.blur(mask.astype(np.float32), kernel, borderType=cv2.BORDER_CONSTANT)
    depth = np.where(mask, 1 / np.maximum(inverse_depth, np.float32(1e-6)), 0).astype(np.float32)
    around = cv2.blur(depth, kernel, borderType=cv2.BORDER_CONSTANT) / np.maximum(weight, 1e-6)
    hollow = (depth - around) / np.float32(depth_m)
    hollow = np.clip(hollow, 0, 1) * np.clip(2 - hollow / 2, 0, 1)
    opened: Shade = 1 - np.float32(0.5) * hollow * mask
    return opened
