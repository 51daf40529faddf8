"""Preset `waterline`: where all ships of a while stand on one water surface.

A detection's lower edge tells a ship's range only together with the height of the water, and the
published method puts both errors into one vertical shift. But the water is the same for all ships
that a viewport sees within some minutes, and so is the small error of the camera's rotation. Here
all of them are found together, as the most probable values given everything at hand:

* each ship's shift over the water and turn, with the uncertainty of its AIS state as prior;
* the water's height against the given level, and the camera's pitch and yaw, with priors too;
* three pieces of evidence a ship: the middle between the detection's side edges, their distance,
  and the lower edge, each seen by the outline of a hull instead of a rectangle's corners.

This is a Gauss-Newton iteration with an arrowhead system: 3 unknowns a ship and 3 shared ones, the
ships eliminated first (Schur complement). With few ships the priors hold the shared unknowns back;
one ship alone cannot tell its range from the water's height, and its covariance says so. The boxes
stand where the camera shows them, so they fit the image although its rotation is a little off.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, sqrt

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.correction import edge_planes
from app.domain.detection import HALF_PIXEL, Detection
from app.domain.edge_evidence import edge_mixing, edge_variance_px2
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import state_covariance
from app.domain.hull_outline import unit_outline
from app.domain.sighting import Sighting, VesselBox

ROUNDS = 5
_SIZE_M = 1.0  # AIS gives whole metres, and people enter them wrong
_TOP_M = 0.2  # masts a detector overlooks
# Evidence more than so many sigmas off counts less for what all ships share.
_SUSPICIOUS = 2.5
_ODD_WIDTH = 1.0  # and widths more than this, to say how a ship heads
# The stated accuracy of AIS counts as much as what so many ships show of it.
_PRIOR_SHIPS = 4.0


def waterline_boxes(
    camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
) -> list[VesselBox]:
    """Find the boxes of all sightings of one viewport within one time window, in their order."""
    if not sightings:
        return []
    problem = _Problem(camera, sightings, settings)
    return _boxes(problem, _solve(problem))


class _Problem:
    """All sightings of a window as stacked arrays: n ships, 3 kinds of evidence, m outline points.

    Ships have the unknowns east_m, north_m and turn (rad, clockwise); all share level_m,
    pitch (rad) and yaw (rad).
    """

    def __init__(
        self, camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
    ) -> None:
        segments = [sighting.candidate.segment for sighting in sightings]
        states = [sighting.candidate.state for sighting in sightings]
        planes = edge_planes(
            camera,
            [_centred(sighting.detection) for sighting in sightings],
            [segment.vessel_axes_in_world[2] for segment in segments],
        )
        self.sightings = sightings
        self.center_in_world = camera.center_in_world
        self.focal_px = sqrt(camera.intrinsics.K[0, 0] * camera.intrinsics.K[1, 1])
        self.box_sigma_px = settings.box_sigma_px
        self.alpha_beta_gamma = np.array([[p.alpha, p.beta, p.gamma] for p in planes])
        self.delta = np.array([p.delta for p in planes])
        axes = np.array([segment.vessel_axes_in_world for segment in segments])
        self.forward, self.port, self.up = axes[:, 0], axes[:, 1], axes[:, 2]
        self.enu = np.array([segment.enu_axes_in_world for segment in segments])
        corners = np.array([segment.corners_in_world for segment in segments])
        self.middle = corners.mean(axis=1)
        away = self.middle - self.center_in_world
        self.range_m = np.linalg.norm(away, axis=1)
        right = np.cross(away, self.up)
        self.right = right / np.linalg.norm(right, axis=1, keepdims=True)
        self.right_in_en = _times(self.enu[:, :2], self.right)
        sizes = np.array([[state.length_m, state.width_m] for state in states])
        self.half_sizes = sizes / 2
        self.outline = unit_outline() * sizes[:, None]
        self.mixing, self.evidence_weight = self._evidence(sightings)
        self.prior_covariance = np.array([state_covariance(state) for state in states])
        self.prior = np.linalg.inv(self.prior_covariance)
        rotation = radians(settings.rotation_sigma_deg)
        self.shared_prior = np.array([settings.level_sigma_m, rotation, rotation]) ** -2.0
        # The error of a ship's AIS is one, however many images show it.
        counts = Counter(state.identifier for state in states)
        self.share = np.array([1 / counts[state.identifier] for state in states])

    def _evidence(self, sightings: Sequence[Sighting]) -> tuple[FloatArray, FloatArray]:
        """Return how edges mix into evidence (n, 3, 3), and its weights (n, 3) in rad^-2."""
        cuts = [sighting.cut for sighting in sightings]
        seen = ~np.array([(cut.left, cut.right, cut.bottom) for cut in cuts])
        boxes = [sighting.detection for sighting in sightings]
        size_px = np.array([(box.x2_px - box.x1_px, box.y2_px - box.y1_px) for box in boxes])
        px_per_m = self.focal_px / self.range_m
        one_side = ~(seen[:, 0] & seen[:, 1])
        variance = edge_variance_px2(self.box_sigma_px, size_px, px_per_m, one_side)
        variance[:, 1] += (_SIZE_M * px_per_m) ** 2
        return edge_mixing(seen), self.focal_px**2 / variance

    def turned(self, turn_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forward and port (n, 3) after a clockwise turn (n,)."""
        cos, sin = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
        return cos * self.forward - sin * self.port, sin * self.forward + cos * self.port

    def middles(self, own: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the middles of the waterplanes (n, 3) as the camera shows them."""
        level_m, pitch, yaw = shared
        return np.asarray(
            self.middle
            + own[:, :1] * self.enu[:, 0]
            + own[:, 1:2] * self.enu[:, 1]
            + (level_m + pitch * self.range_m)[:, None] * self.up
            + (yaw * self.range_m)[:, None] * self.right
        )


@dataclass(frozen=True, eq=False)
class _Solution:
    """Unknowns of the ships (n, 3), the shared ones (3,), and the covariances of all (n, 6, 6)."""

    own: FloatArray
    shared: FloatArray
    covariance: FloatArray


def _solve(problem: _Problem) -> _Solution:
    count = len(problem.sightings)
    own, shared = np.zeros((count, 3)), np.zeros(3)
    for _ in range(ROUNDS):
        residual, by_own, by_shared = _linearised(problem, own, shared)
        scale = _scale(problem, own)
        prior, prior_covariance = problem.prior / scale, problem.prior_covariance * scale
        deviation = _deviation(problem, prior_covariance, residual, by_own, own)
        weight = problem.evidence_weight.copy()
        weight[:, 1] /= np.maximum(1.0, deviation[:, 1] / _ODD_WIDTH) ** 2
        weighted = by_own * weight[..., None]
        A = np.swapaxes(weighted, 1, 2) @ by_own + prior
        B = np.swapaxes(weighted, 1, 2) @ by_shared
        D = np.swapaxes(by_shared * weight[..., None], 1, 2) @ by_shared
        own_slope = (weighted * residual[..., None]).sum(axis=1) + _times(prior, own)
        all_slopes = ((by_shared * weight[..., None]) * residual[..., None]).sum(axis=1)
        A_inverse = np.asarray(np.linalg.inv(A), dtype=np.float64)
        gain = A_inverse @ B
        # Schur complement: what the ships leave to be known of the shared unknowns.
        trust = 1 / np.maximum(1.0, deviation.max(axis=1) / _SUSPICIOUS) ** 2
        share = (problem.share * trust)[:, None]
        information = np.diag(problem.shared_prior) + (
            share[..., None] * (D - np.swapaxes(B, 1, 2) @ gain)
        ).sum(axis=0)
        slope = problem.shared_prior * shared + (
            share * (all_slopes - _times(np.swapaxes(gain, 1, 2), own_slope))
        ).sum(axis=0)
        shared_step = -np.linalg.solve(information, slope)
        own = own - _times(A_inverse, own_slope) - gain @ shared_step
        shared = shared + shared_step
    shared_covariance = np.linalg.inv(information)
    covariance = np.empty((count, 6, 6))
    covariance[:, :3, :3] = A_inverse + gain @ shared_covariance @ np.swapaxes(gain, 1, 2)
    covariance[:, 3:, 3:] = shared_covariance
    covariance[:, :3, 3:] = -gain @ shared_covariance
    covariance[:, 3:, :3] = np.swapaxes(covariance[:, :3, 3:], 1, 2)
    return _Solution(own, shared, covariance)


def _scale(problem: _Problem, own: FloatArray) -> FloatArray:
    """Return by how much (3, 3) the covariances of AIS are to be rescaled to how far ships are off.

    The image shows each ship's error across the line of sight well, whatever the water does: what
    all of them show there tells how good AIS is here along the line of sight too.
    """
    if not own.any():
        return np.ones((3, 3))
    right = problem.right_in_en
    across = (own[:, :2] * right).sum(axis=1)
    expected = np.einsum("ni,nij,nj->n", right, problem.prior_covariance[:, :2, :2], right)
    squares = np.minimum(across**2 / expected, _SUSPICIOUS**2)
    scale = (_PRIOR_SHIPS + problem.share @ squares) / (_PRIOR_SHIPS + problem.share.sum())
    return np.array([[scale, scale, 1.0], [scale, scale, 1.0], [1.0, 1.0, 1.0]])


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply matrices (n, k, m) with as many vectors (n, m)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _deviation(
    problem: _Problem,
    prior_covariance: FloatArray,
    residual: FloatArray,
    by_own: FloatArray,
    own: FloatArray,
) -> FloatArray:
    """Return how many sigmas each piece of evidence (n, 3) is from what AIS leads to expect.

    A ship whose evidence cannot be reconciled with its AIS state is probably another ship, and may
    say little of the shared unknowns. One that only looks too wide or too narrow has other sizes
    than AIS says or is half hidden, and is not turned for it.
    """
    innovation = residual - _times(by_own, own)
    spread = ((by_own @ prior_covariance) * by_own).sum(axis=2)
    expected = spread + 1 / problem.evidence_weight
    return np.asarray(np.abs(innovation / np.sqrt(expected)))


def _linearised(
    problem: _Problem, own: FloatArray, shared: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return residuals (n, 3) in rad and their slopes by own and shared unknowns (n, 3, 3)."""
    forward, port = problem.turned(own[:, 2])
    along, across = problem.outline[..., :1], problem.outline[..., 1:]
    away = (problem.middles(own, shared) - problem.center_in_world)[:, None]
    points = away + along * forward[:, None] + across * port[:, None]
    turning = across * forward[:, None] - along * port[:, None]
    normals = problem.alpha_beta_gamma
    distances = points @ np.swapaxes(normals, 1, 2)
    # The paper's extreme corners: the leftmost, the rightmost and the lowest point.
    extreme = np.stack(
        [distances[..., 0].argmax(1), distances[..., 1].argmin(1), distances[..., 2].argmax(1)], 1
    )
    ship = np.arange(len(extreme))[:, None]
    gap = np.stack([distances[ship[:, 0], extreme[:, edge], edge] for edge in range(3)], 1)
    by_turn = (normals * turning[ship, extreme]).sum(axis=2)
    by_place = normals @ np.swapaxes(problem.enu[:, :2], 1, 2)
    by_level = (normals @ problem.up[..., None])[..., 0]
    by_right = (normals @ problem.right[..., None])[..., 0]
    per_m = 1 / problem.range_m[:, None]
    mixed = problem.mixing * per_m[..., None]
    by_own = mixed @ np.concatenate([by_place, by_turn[..., None]], axis=2)
    by_shared = mixed @ np.stack([by_level, by_level / per_m, by_right / per_m], axis=2)
    return _times(mixed, gap), by_own, by_shared


def _centred(detection: Detection) -> Detection:
    """Return a detection counted from the centre of the first pixel, as lines of sight are."""
    return Detection(
        detection.x1_px - HALF_PIXEL,
        detection.y1_px - HALF_PIXEL,
        detection.x2_px - HALF_PIXEL,
        detection.y2_px - HALF_PIXEL,
        detection.score,
        detection.class_id,
    )


# Bow-port, bow-starboard, stern-starboard, stern-port, in half lengths and half widths.
_CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


def _boxes(problem: _Problem, solution: _Solution) -> list[VesselBox]:
    """Raise each ship's corners from the water to the upper edge of its detection."""
    forward, port = problem.turned(solution.own[:, 2])
    up, delta, range_m = problem.up, problem.delta, problem.range_m
    middle = problem.middles(solution.own, solution.shared)
    along, across = np.swapaxes(problem.half_sizes[:, None] * _CORNERS, 0, 2)
    bottom = np.swapaxes(middle + along[..., None] * forward + across[..., None] * port, 0, 1)
    # Masts stand amidships rather than at a corner: the middle is raised until it touches delta.
    rise = (delta * up).sum(axis=1)
    height_m = -(delta * (middle - problem.center_in_world)).sum(axis=1) / rise
    to_enu = np.zeros((len(middle), 3, 6))
    to_enu[:, 0, 0] = to_enu[:, 1, 1] = to_enu[:, 2, 3] = 1.0
    to_enu[:, 2, 4] = range_m
    to_enu[:, :, 5] = range_m[:, None] * _times(problem.enu, problem.right)
    covariance = to_enu @ solution.covariance @ np.swapaxes(to_enu, 1, 2)
    by_place = -_times(problem.enu, delta) / rise[:, None]
    edge_m = problem.box_sigma_px * range_m / problem.focal_px
    height_variance = (by_place * _times(covariance, by_place)).sum(axis=1) + edge_m**2 + _TOP_M**2
    heading_sigma_deg = np.degrees(np.sqrt(solution.covariance[:, 2, 2]))
    turn_deg = np.degrees(solution.own[:, 2])
    level_m, pitch, _ = solution.shared
    axes = np.stack([forward, port, up], axis=1)
    return [
        VesselBox(
            vessel_axes_in_world=axes[index],
            heading_deg=float((sighting.candidate.state.heading_deg + turn_deg[index]) % 360),
            bottom_in_world=bottom[index],
            top_from_bottom_m=height_m[index] * up[index],
            height_m=float(height_m[index]),
            water_level_m=float(sighting.water_level_m + level_m + pitch * range_m[index]),
            position_covariance_in_enu_m2=covariance[index],
            heading_sigma_deg=float(heading_sigma_deg[index]),
            height_sigma_m=float(np.sqrt(height_variance[index])),
        )
        for index, sighting in enumerate(problem.sightings)
    ]
