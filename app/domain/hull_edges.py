"""Where the edges of vessels should be in an image, and how sure that is.

A detection of a vessel touches its hull on the left, on the right and below. Where AIS has the
vessel, the outline of its hull gives these three edges too; by their slopes the uncertainty of the
AIS state becomes one of edges, and so does what all vessels of a viewport share: the height of the
water and a small turn of the camera.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, sqrt

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.hull_outline import unit_outline
from app.domain.vessel_state import VesselState

# Steps of the slopes: far above rounding, far below what the outline's curvature would show.
_STEP_M = 0.5
_STEP_RAD = 0.01
# A vessel without known size has edges all the same.
_LEAST_LENGTH_M = 5.0
_LEAST_WIDTH_M = 2.0


@dataclass(frozen=True, eq=False)
class HullEdges:
    """Left, right and lower edges of n candidates, px from the centre of the first pixel.

    `edges_px` (n, 3); `covariance_px2` (n, 3, 3) of them by the AIS states alone; `by_shared`
    (n, 3, 3) their slopes by the water's height (m), the camera's pitch (rad, lower edges go down)
    and yaw (rad, all goes right). `px_per_m` (n,) is the scale at each.
    """

    edges_px: FloatArray
    covariance_px2: FloatArray
    by_shared: FloatArray
    px_per_m: FloatArray
    has_size: BoolArray

    @classmethod
    def of(cls, camera: Camera, candidates: Sequence[Candidate]) -> "HullEdges":
        """Project the hulls of candidates, each as AIS has it and moved a little."""
        states = [candidate.state for candidate in candidates]
        corners = np.array([c.segment.corners_in_world for c in candidates])
        axes = np.array([c.segment.vessel_axes_in_world for c in candidates])
        enu = np.array([c.segment.enu_axes_in_world for c in candidates])
        middle = corners.mean(axis=1)
        sizes = [
            (max(state.length_m, _LEAST_LENGTH_M), max(state.width_m, _LEAST_WIDTH_M))
            for state in states
        ]
        outline = unit_outline() * np.array(sizes)[:, None]
        along, across = outline[..., :1], outline[..., 1:]
        hull = middle[:, None] + along * axes[:, None, 0] + across * axes[:, None, 1]
        clockwise = across * axes[:, None, 0] - along * axes[:, None, 1]
        moved = np.stack(
            [
                hull,
                hull + _STEP_M * enu[:, None, 0],
                hull + _STEP_M * enu[:, None, 1],
                hull + _STEP_RAD * clockwise,
                hull + _STEP_M * axes[:, None, 2],
            ],
            axis=1,
        )
        pixels = camera.project(moved.reshape(-1, 3)).reshape(*moved.shape[:3], 2)
        low, high = pixels.min(axis=2), pixels.max(axis=2)
        edges = np.stack([low[..., 0], high[..., 0], high[..., 1]], axis=-1)
        steps = np.array([_STEP_M, _STEP_M, _STEP_RAD, _STEP_M])
        slopes = np.swapaxes(edges[:, 1:] - edges[:, :1], 1, 2) / steps
        focal_px = sqrt(camera.intrinsics.K[0, 0] * camera.intrinsics.K[1, 1])
        by_shared = np.zeros((len(states), 3, 3))
        by_shared[:, :, 0] = slopes[:, :, 3]
        by_shared[:, 2, 1] = focal_px
        by_shared[:, :2, 2] = focal_px
        by_state = slopes[:, :, :3]
        uncertainty = np.array([state_covariance(state) for state in states])
        return cls(
            edges_px=edges[:, 0],
            covariance_px2=by_state @ uncertainty @ np.swapaxes(by_state, 1, 2),
            by_shared=by_shared,
            px_per_m=focal_px / np.linalg.norm(middle - camera.center_in_world, axis=1),
            has_size=np.array([c.has_size for c in candidates]),
        )


def state_covariance(state: VesselState) -> FloatArray:
    """Return the covariance (3, 3) of east, north (m) and heading (rad) as AIS has them."""
    east, east_north, north = state.position_covariance_m2
    heading = radians(state.heading_sigma_deg) ** 2
    return np.array([[east, east_north, 0.0], [east_north, north, 0.0], [0.0, 0.0, heading]])
