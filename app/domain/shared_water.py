"""What all ships of a while have in common, found together with where each of them is.

A detection's lower edge tells a ship's range only together with the height of the water. But the
water is the same for all ships that a viewport sees within some minutes, and so is the small error
of the camera's rotation. All of it is found at once, as the most probable values:

* each ship's shift over the water and turn, with the uncertainty of its AIS state as prior;
* the water's height against the given level, and the camera's pitch, yaw and roll, with priors too;
* three pieces of evidence a ship: the middle between the detection's side edges, their distance,
  and the lower edge, each seen by the outline of a hull instead of a rectangle's corners. Whose
  hull it is nobody knows: evidence counts less where a full and a slim one differ much.

This is a Gauss-Newton iteration with an arrowhead system: 3 unknowns a ship and 4 shared ones, the
ships eliminated first (Schur complement). With few ships the priors hold the shared unknowns back;
one ship alone cannot tell its range from the water's height, and its covariance says so.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, sqrt

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera
from app.domain.correction import edge_normals
from app.domain.detection import HALF_PIXEL
from app.domain.edge_evidence import ANY_OUTLINE, edge_mixing, edge_variance_px2
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import state_covariance
from app.domain.hull_outline import FULL_HULL, slim_outline
from app.domain.sighting import Sighting
from app.domain.vessel_state import HeadingSource

ROUNDS = 5
SHARED = 4  # unknowns of all ships: level_m, pitch, yaw, roll (rad)
_SIZE_M = 1.0  # AIS gives whole metres, and people enter them wrong
# Where between a slim and a full hull most hulls are, and one sigma of that.
_FULLNESS, _FULLNESS_SIGMA = 0.3, 0.28
# Evidence more than so many sigmas off counts less for what all ships share.
_SUSPICIOUS = 2.5
_ODD_WIDTH = 1.0  # and widths more than this, to say how a ship heads
# The stated accuracy of AIS counts as much as what so many ships show of it.
_PRIOR_SHIPS = 4.0
# The same of headings, and limits of their scale: compasses may only be worse than said.
_COMPASSES = (4.0, (1.0, 4.0))
_COURSES = (1.0, (0.04, 4.0))


class Roads:
    """All sightings of a window as stacked arrays: n ships, 3 kinds of evidence.

    Ships have the unknowns east_m, north_m and turn (rad, clockwise); all share level_m, pitch,
    yaw and roll (rad).
    """

    def __init__(
        self, camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
    ) -> None:
        segments = [sighting.candidate.segment for sighting in sightings]
        states = [sighting.candidate.state for sighting in sightings]
        boxes = np.array([sighting.detection.edges_px for sighting in sightings])
        axes = np.array([segment.vessel_axes_in_world for segment in segments])
        self.forward, self.port, self.up = axes[:, 0], axes[:, 1], axes[:, 2]
        # Lines of sight count from the centre of the first pixel.
        normals = edge_normals(camera, boxes - HALF_PIXEL, self.up)
        self.alpha_beta_gamma, self.delta = normals[:, :3], normals[:, 3]
        self.center_in_world = camera.center_in_world
        self.focal_px = sqrt(camera.intrinsics.K[0, 0] * camera.intrinsics.K[1, 1])
        self.box_sigma_px = settings.box_sigma_px
        self.enu = np.array([segment.enu_axes_in_world for segment in segments])
        self.middle = np.array([segment.corners_in_world for segment in segments]).mean(axis=1)
        away = self.middle - self.center_in_world
        self.range_m = np.linalg.norm(away, axis=1)
        right = np.cross(away, self.up)
        self.right = right / np.linalg.norm(right, axis=1, keepdims=True)
        self.right_in_en = times(self.enu[:, :2], self.right)
        # How far a ship lies to the right of the camera's axis: a roll lifts it by as much.
        self.aside_m = away @ camera.R_cam_from_world[0]
        self.sizes = np.array([[state.length_m, state.width_m] for state in states])
        self.full = FULL_HULL * self.sizes[:, None]
        self.slim = slim_outline() * self.sizes[:, None]
        seen = ~np.array([(s.cut.left, s.cut.right, s.cut.bottom) for s in sightings])
        self.size_px = boxes[:, 2:] - boxes[:, :2]
        self.mixing, self.evidence_variance = self._evidence(seen)
        self.prior_covariance = np.array([state_covariance(state) for state in states])
        self.prior = np.linalg.inv(self.prior_covariance)
        rotation = radians(settings.rotation_sigma_deg)
        self.shared_prior = np.array([settings.level_sigma_m, *[rotation] * 3]) ** -2.0
        self.is_reported = np.array(
            [state.heading_source is HeadingSource.REPORTED for state in states]
        )
        # The error of a ship's AIS is one, however many images show it.
        counts = Counter(state.identifier for state in states)
        self.share = np.array([1 / counts[state.identifier] for state in states])

    def _evidence(self, seen: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Return how edges mix into evidence (n, 3, 3), and its variances (n, 3) in rad^2."""
        px_per_m = self.focal_px / self.range_m
        one_side = ~(seen[:, 0] & seen[:, 1])
        variance = edge_variance_px2(
            self.box_sigma_px, self.size_px, px_per_m, one_side, ANY_OUTLINE
        )
        variance[:, 1] += (_SIZE_M * px_per_m) ** 2
        return edge_mixing(seen), variance / self.focal_px**2

    def turned(self, turn_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forward and port (n, 3) after a clockwise turn (n,)."""
        cos, sin = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
        return cos * self.forward - sin * self.port, sin * self.forward + cos * self.port

    def middles(self, own: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the middles of the waterplanes (n, 3) as the camera shows them."""
        level_m, pitch, yaw, roll = shared
        lifted = level_m + pitch * self.range_m + roll * self.aside_m
        return np.asarray(
            self.middle
            + own[:, :1] * self.enu[:, 0]
            + own[:, 1:2] * self.enu[:, 1]
            + lifted[:, None] * self.up
            + (yaw * self.range_m)[:, None] * self.right
        )


@dataclass(frozen=True, eq=False)
class Solution:
    """Unknowns of the ships (n, 3), the shared ones (4,), and the covariances of all (n, 7, 7).

    `deviation` (n,) is by how many sigmas the image contradicts AIS most.
    """

    own: FloatArray
    shared: FloatArray
    covariance: FloatArray
    deviation: FloatArray


def solve(roads: Roads) -> Solution:
    """Find the most probable places, turns and shared unknowns."""
    count = len(roads.share)
    own, shared = np.zeros((count, 3)), np.zeros(SHARED)
    for _ in range(ROUNDS):
        residual, by_own, by_shared, hull_variance = _linearised(roads, own, shared)
        variance = roads.evidence_variance + hull_variance
        scale = _scale(roads, variance, residual, by_own, own)
        prior, prior_covariance = roads.prior / scale, roads.prior_covariance * scale
        deviation = _deviation(variance, prior_covariance, residual, by_own, own)
        variance[:, 1] *= np.maximum(1.0, deviation[:, 1] / _ODD_WIDTH) ** 2
        weighted = np.swapaxes(by_own / variance[..., None], 1, 2)
        A = weighted @ by_own + prior
        B = weighted @ by_shared
        all_weighted = np.swapaxes(by_shared / variance[..., None], 1, 2)
        own_slope = times(weighted, residual) + times(prior, own)
        A_inverse = np.asarray(np.linalg.inv(A), dtype=np.float64)
        gain = A_inverse @ B
        # Schur complement: what the ships leave to be known of the shared unknowns.
        gained = np.swapaxes(gain, 1, 2)
        trust = 1 / np.maximum(1.0, deviation.max(axis=1) / _SUSPICIOUS) ** 2
        share = roads.share * trust
        left = all_weighted @ by_shared - np.swapaxes(B, 1, 2) @ gain
        information = np.diag(roads.shared_prior) + np.tensordot(share, left, 1)
        slope = roads.shared_prior * shared + share @ (
            times(all_weighted, residual) - times(gained, own_slope)
        )
        shared_step = -np.linalg.solve(information, slope)
        own = own - times(A_inverse, own_slope) - gain @ shared_step
        shared = shared + shared_step
    shared_covariance = np.linalg.inv(information)
    covariance = np.empty((count, 3 + SHARED, 3 + SHARED))
    covariance[:, :3, :3] = A_inverse + gain @ shared_covariance @ gained
    covariance[:, 3:, 3:] = shared_covariance
    covariance[:, :3, 3:] = -gain @ shared_covariance
    covariance[:, 3:, :3] = np.swapaxes(covariance[:, :3, 3:], 1, 2)
    return Solution(own, shared, covariance, deviation.max(axis=1))


def times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply matrices (n, k, m) with as many vectors (n, m)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _scale(
    roads: Roads,
    variance: FloatArray,
    residual: FloatArray,
    by_own: FloatArray,
    own: FloatArray,
) -> FloatArray:
    """Return by how much (n, 3, 3) covariances of AIS are to be rescaled to how far ships are off.

    The image shows each ship's error across the line of sight well, whatever the water does: what
    all of them show there tells how good AIS is here along the line of sight too. And how wide
    ships look tells how good headings are, those of compasses and those taken from courses apart:
    without current a course is far better than it is said to be.
    """
    scale = np.ones((len(own), 3, 3))
    if not own.any():
        return scale
    right = roads.right_in_en
    across = (own[:, :2] * right).sum(axis=1)
    expected = (right * times(roads.prior_covariance[:, :2, :2], right)).sum(axis=1)
    squares = np.minimum(across**2 / expected, _SUSPICIOUS**2)
    place = (_PRIOR_SHIPS + roads.share @ squares) / (_PRIOR_SHIPS + roads.share.sum())
    scale[:, :2, :2] = place
    width = by_own[:, 1]
    by_heading = width[:, 2] ** 2 * roads.prior_covariance[:, 2, 2]
    by_place = (width[:, :2] * times(roads.prior_covariance[:, :2, :2], width[:, :2])).sum(axis=1)
    others = by_place * place + variance[:, 1]
    innovation = residual[:, 1] - (width * own).sum(axis=1)
    excess = np.minimum(innovation**2, _SUSPICIOUS**2 * (by_heading + others)) - others
    for group, prior, limits in (
        (roads.is_reported, *_COMPASSES),
        (~roads.is_reported, *_COURSES),
    ):
        # Each ship's square tells as much as the heading has part in it.
        told = by_heading[group] / (by_heading + others)[group] ** 2 * roads.share[group]
        heading = (prior + told @ excess[group]) / (prior + told @ by_heading[group])
        scale[group, 2, 2] = np.clip(heading, *limits)
    return scale


def _deviation(
    variance: FloatArray,
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
    innovation = residual - times(by_own, own)
    spread = ((by_own @ prior_covariance) * by_own).sum(axis=2)
    return np.asarray(np.abs(innovation) / np.sqrt(spread + variance))


def _linearised(
    roads: Roads, own: FloatArray, shared: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return residuals (n, 3) in rad, their slopes by own (n, 3, 3) and shared unknowns (n, 3, 4).

    The last are the residuals' variances (n, 3) by the unknown shape of the hull.
    """
    forward, port = roads.turned(own[:, 2])
    middle = roads.middles(own, shared) - roads.center_in_world
    normals = roads.alpha_beta_gamma
    full_m, full_turning = _gaps(normals, middle, forward, port, roads.full)
    slim_m, slim_turning = _gaps(normals, middle, forward, port, roads.slim)
    gap = slim_m + _FULLNESS * (full_m - slim_m)
    by_turn = slim_turning + _FULLNESS * (full_turning - slim_turning)
    by_place = normals @ np.swapaxes(roads.enu[:, :2], 1, 2)
    by_level = times(normals, roads.up)
    by_yaw = times(normals, roads.right) * roads.range_m[:, None]
    mixed = roads.mixing / roads.range_m[:, None, None]
    by_pitch, by_roll = (by_level * lift[:, None] for lift in (roads.range_m, roads.aside_m))
    by_own = mixed @ np.concatenate([by_place, by_turn[..., None]], axis=2)
    by_shared = mixed @ np.stack([by_level, by_pitch, by_yaw, by_roll], axis=2)
    unsure = (mixed * (_FULLNESS_SIGMA * (full_m - slim_m))[:, None]) ** 2
    return times(mixed, gap), by_own, by_shared, unsure.sum(axis=2)


def _gaps(
    normals: FloatArray,
    middle: FloatArray,
    forward: FloatArray,
    port: FloatArray,
    outline: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return how far outlines' extreme points (n, 3) lie beyond planes, and that by a turn.

    They are the paper's extreme corners: the leftmost, the rightmost and the lowest point.
    """
    ahead, abeam = times(normals, forward), times(normals, port)
    reach = outline @ np.stack([ahead, abeam], axis=1)
    extreme = reach.argmax(axis=1)
    extreme[:, 1] = reach[..., 1].argmin(axis=1)
    ship, edge = np.arange(len(normals))[:, None], np.arange(3)
    point = outline[ship, extreme]
    gap = times(normals, middle) + reach[ship, extreme, edge]
    return gap, point[..., 1] * ahead - point[..., 0] * abeam
