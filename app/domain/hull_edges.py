"""Where the edges of vessels should be in an image, and how sure that is.

A detection of a vessel touches its hull on the left, on the right and below. Where AIS has the
vessel, the outline of its hull gives these three edges too; by their slopes the uncertainty of the
AIS state becomes one of edges, and so does what all vessels of a viewport share: the height of the
water and a small turn of the camera.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.covariances import carried
from app.domain.hull_outline import unit_outline
from app.domain.vessel_state import VesselState
from app.domain.waterplane import WaterPlane

# Steps of the slopes: far above rounding, far below what the outline's curvature would show.
_STEP_M = 0.5
_STEP_RAD = 0.01
# A vessel without known size has edges all the same.
_LEAST_LENGTH_M = 5.0
_LEAST_WIDTH_M = 2.0


@dataclass(frozen=True, eq=False)
class HullEdges:
    """Left, right and lower edges of n candidates, px from the centre of the first pixel.

    `edges_px` (3, n); `covariance_px2` (3, 3, n) of them by the AIS states alone; `by_shared`
    (3, 3, n) their slopes by the water's height (m), the camera's pitch (rad, lower edges go down)
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
        plane = WaterPlane.of([candidate.segment for candidate in candidates])
        away = plane.middles_in_world - camera.center_in_world
        ends_m = np.array(
            [(s.to_bow_m, s.to_stern_m, s.to_port_m, s.to_starboard_m) for s in states]
        )
        edges = _edges(camera, away, plane, ends_m)
        steps = np.array([_STEP_M, _STEP_M, _STEP_RAD, _STEP_M])
        slopes = (edges[:, 1:] - edges[:, :1]) / steps[:, None]
        focal_px = sqrt(camera.intrinsics.K[0, 0] * camera.intrinsics.K[1, 1])
        by_shared = np.zeros((3, 3, len(states)))
        by_shared[:, 0] = slopes[:, 3]
        by_shared[2, 1] = focal_px
        by_shared[:2, 2] = focal_px
        return cls(
            edges_px=edges[:, 0],
            covariance_px2=carried(slopes[:, :3], state_covariances(states)),
            by_shared=by_shared,
            px_per_m=focal_px / np.sqrt((away**2).sum(axis=1)),
            has_size=(ends_m.reshape(-1, 2, 2).sum(axis=2) > 0).any(axis=1),
        )


def _edges(camera: Camera, away_m: FloatArray, plane: WaterPlane, ends_m: FloatArray) -> FloatArray:
    """Return left, right and lower edges (3, 5, n) of hulls: still, and moved in four ways.

    East, north, turned clockwise about the antenna, up. Vessels' bows, sterns, port and starboard
    sides are `ends_m` (n, 4) from it. Coordinates come first, then ways, the outline's points and
    vessels, so that each operation runs over all of them.
    """
    to_cam = camera.R_cam_from_world.T
    middle = (away_m @ to_cam).T
    forward, port, up = (plane.vessel_axes_in_world @ to_cam).transpose(1, 2, 0)
    east, north, _ = (plane.enu_axes_in_world @ to_cam).transpose(1, 2, 0)
    outline = unit_outline()
    bow, stern, left, right = ends_m.T
    length_m = np.maximum(bow + stern, _LEAST_LENGTH_M)
    width_m = np.maximum(left + right, _LEAST_WIDTH_M)
    along, across = outline[:, :1] * length_m, outline[:, 1:] * width_m
    still = middle[:, None] + along * forward[:, None] + across * port[:, None]
    ahead, aport = along + (bow - stern) / 2, across + (left - right) / 2
    clockwise = aport * forward[:, None] - ahead * port[:, None]
    hulls = np.empty((3, 5, *along.shape))
    hulls[:, 0] = still
    hulls[:, 1] = still + _STEP_M * east[:, None]
    hulls[:, 2] = still + _STEP_M * north[:, None]
    hulls[:, 3] = still + _STEP_RAD * clockwise
    hulls[:, 4] = still + _STEP_M * up[:, None]
    x_px, y_px = camera.shown(hulls)
    return np.array([x_px.min(axis=1), x_px.max(axis=1), y_px.max(axis=1)])


def state_covariances(states: Sequence[VesselState]) -> FloatArray:
    """Return the covariances (3, 3, n) of east, north (m) and heading (rad) as AIS has them."""
    covariances = np.zeros((3, 3, len(states)))
    east, east_north, north = np.array([state.position_covariance_m2 for state in states]).T
    covariances[0, 0], covariances[1, 1] = east, north
    covariances[0, 1] = covariances[1, 0] = east_north
    covariances[2, 2] = np.radians([state.heading_sigma_deg for state in states]) ** 2
    return covariances
