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

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.correction import edge_normals
from app.domain.covariances import carried, lower_factor, unwhitened, whitened
from app.domain.detection import HALF_PIXEL
from app.domain.edge_evidence import ANY_OUTLINE, EdgeShares, edge_variance_px2
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import state_covariances
from app.domain.hull_outline import FULL_HULL, slim_outline
from app.domain.sighting import Sighting
from app.domain.vessel_state import HeadingSource
from app.domain.waterplane import WaterPlane

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
# The same of headings, their scale before looking, and its limits: compasses may only be worse than
# said, while two of three ships of recorded traffic head within 0.45 sigmas of their course.
_COMPASSES = (4.0, 1.0, (1.0, 4.0))
_COURSES = (4.0, 0.2, (0.1, 4.0))
# A lower edge this many sigmas above where it should be may be another ship's bulwark.
_HIDDEN_BELOW = 1.5
# Beyond so many sigmas what all ships share is held back less and less: it may be worse than said.
_SURPRISING = 1.5


class Roads:
    """All sightings of a window as arrays whose last axis is the n ships; 3 kinds of evidence.

    Ships have the unknowns east_m, north_m and turn (rad, clockwise); all share level_m, pitch,
    yaw and roll (rad). Vectors are (3, n), coordinates first.
    """

    def __init__(
        self, camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
    ) -> None:
        plane = WaterPlane.of([sighting.candidate.segment for sighting in sightings])
        states = [sighting.candidate.state for sighting in sightings]
        boxes = np.array([sighting.detection.edges_px for sighting in sightings])
        self.forward, self.port, self.up = _ships_last(plane.vessel_axes_in_world)
        # Lines of sight count from the centre of the first pixel.
        normals = edge_normals(camera, boxes - HALF_PIXEL, self.up.T)
        self.alpha_beta_gamma, self.delta = np.split(_ships_last(normals), [3])
        self.delta = self.delta[0]
        self.center_in_world = camera.center_in_world[:, None]
        self.focal_px = sqrt(camera.intrinsics.K[0, 0] * camera.intrinsics.K[1, 1])
        self.box_sigma_px = settings.box_sigma_px
        self.enu = _ships_last(plane.enu_axes_in_world)
        self.antenna = _ships_last(plane.antenna_in_world)
        # A ship turns about its antenna, whose place AIS tells.
        self.ahead_m, self.aport_m = (
            np.array(
                [(s.to_bow_m - s.to_stern_m, s.to_port_m - s.to_starboard_m) for s in states]
            ).T
            / 2
        )
        middle = _ships_last(plane.corners_in_world.mean(axis=1))
        away = middle - self.center_in_world
        self.range_m = np.sqrt((away**2).sum(axis=0))
        right = np.cross(away, self.up, axis=0)
        self.right = right / np.sqrt((right**2).sum(axis=0))
        self.right_in_en = times(self.enu[:2], self.right)
        # How far a ship lies to the right of the camera's axis: a roll lifts it by as much.
        self.aside_m = camera.R_cam_from_world[0] @ away
        self.sizes = np.array([(state.length_m, state.width_m) for state in states]).T
        self.cut = np.array([(s.cut.left, s.cut.right, s.cut.bottom) for s in sightings]).T
        self.shares = EdgeShares.of(~self.cut)
        self.size_px = (boxes[:, 2:] - boxes[:, :2]).T
        self.evidence_variance = self._evidence_variance()
        self.by_place, self.by_shared = self._constant_slopes()
        self.prior_covariance = state_covariances(states)
        self.prior = _inverse(self.prior_covariance)
        rotation = radians(settings.rotation_sigma_deg)
        self.shared_prior = np.array([settings.level_sigma_m, *[rotation] * 3]) ** -2.0
        self.is_reported = np.array(
            [state.heading_source is HeadingSource.REPORTED for state in states]
        )
        # The error of a ship's AIS is one, however many images show it.
        counts = Counter(state.identifier for state in states)
        self.share = np.array([1 / counts[state.identifier] for state in states])

    def _evidence_variance(self) -> FloatArray:
        """Return the variances (3, n) of the evidence by boxes and sizes, rad^2."""
        px_per_m = self.focal_px / self.range_m
        variance = edge_variance_px2(
            self.box_sigma_px, self.size_px, px_per_m, self.cut[0] | self.cut[1], ANY_OUTLINE
        )
        variance[1] += (_SIZE_M * px_per_m) ** 2
        return variance / self.focal_px**2

    def _constant_slopes(self) -> tuple[FloatArray, FloatArray]:
        """Return the slopes of the evidence by east and north (3, 2, n), and shared (3, 4, n)."""
        normals = self.alpha_beta_gamma
        by_place = np.stack([times(normals, self.enu[0]), times(normals, self.enu[1])], axis=1)
        by_level = times(normals, self.up)
        by_shared = np.stack(
            [
                by_level,
                by_level * self.range_m,
                times(normals, self.right) * self.range_m,
                by_level * self.aside_m,
            ],
            axis=1,
        )
        return self.mixed(by_place), self.mixed(by_shared)

    def mixed(self, of_planes_m: FloatArray) -> FloatArray:
        """Make evidence (3, ..., n) in rad of what alpha, beta and gamma (3, ..., n) have in m."""
        return np.asarray(self.shares.mixed(of_planes_m) / self.range_m)

    def turned(self, turn_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forward and port (3, n) after a clockwise turn (n,)."""
        cos, sin = np.cos(turn_rad), np.sin(turn_rad)
        return cos * self.forward - sin * self.port, sin * self.forward + cos * self.port

    def middles(self, own: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the middles of the waterplanes (3, n) as the camera shows them."""
        level_m, pitch, yaw, roll = shared
        lifted = level_m + pitch * self.range_m + roll * self.aside_m
        forward, port = self.turned(own[2])
        return np.asarray(
            self.antenna
            + self.ahead_m * forward
            + self.aport_m * port
            + own[0] * self.enu[0]
            + own[1] * self.enu[1]
            + lifted * self.up
            + yaw * self.range_m * self.right
        )

    def swung(self, own: FloatArray) -> FloatArray:
        """Return how far the middles (3, n) move by a turn (rad) about their antennas."""
        forward, port = self.turned(own[2])
        return np.asarray(self.aport_m * forward - self.ahead_m * port)


def _ships_last(rows: FloatArray) -> FloatArray:
    """Return arrays (n, ...) with the ships on their last axis."""
    return np.ascontiguousarray(np.moveaxis(rows, 0, -1))


def _inverse(prior_covariance: FloatArray) -> FloatArray:
    """Invert covariances (3, 3, n) of places and, apart from them, headings."""
    inverse = np.zeros_like(prior_covariance)
    east, north, heading = prior_covariance[range(3), range(3)]
    both = prior_covariance[0, 1]
    determinant = east * north - both**2
    inverse[0, 0], inverse[1, 1] = north / determinant, east / determinant
    inverse[0, 1] = inverse[1, 0] = -both / determinant
    inverse[2, 2] = 1 / heading
    return inverse


@dataclass(frozen=True, eq=False)
class Solution:
    """Unknowns of the ships (3, n), the shared ones (4,), and the covariances of all (7, 7, n).

    `deviation` (n,) is by how many sigmas the image contradicts AIS most, `hidden_m` (n,) how much
    of the ship's breadth across the line of sight is beyond the sides of its detection.
    """

    own: FloatArray
    shared: FloatArray
    covariance: FloatArray
    deviation: FloatArray
    hidden_m: FloatArray


def solve(roads: Roads) -> Solution:
    """Find the most probable places, turns and shared unknowns."""
    own, shared = np.zeros((3, len(roads.share))), np.zeros(SHARED)
    by_shared, of_shared = roads.by_shared, np.diag(1 / roads.shared_prior)
    for _ in range(ROUNDS):
        residual, by_own, hull_variance, hidden_m = _linearised(roads, own, shared)
        variance = roads.evidence_variance + hull_variance
        scale = _scale(roads, variance, residual, by_own, own)
        prior, prior_covariance = roads.prior / scale, roads.prior_covariance * scale
        innovation = residual - times(by_own, own)
        spread = variance + _spread(prior_covariance, by_own, of_shared, by_shared)
        deviation = np.abs(innovation) / np.sqrt(spread)
        variance[0] += _of_hidden_sides(innovation[1], deviation[1])
        variance[1] *= np.maximum(1.0, deviation[1] / _ODD_WIDTH) ** 2
        is_high = innovation[2] > 0
        variance[2] *= np.where(is_high, np.maximum(1.0, deviation[2] / _HIDDEN_BELOW) ** 2, 1.0)
        shared_prior = _eased(roads.shared_prior, shared)
        weighted = by_own / variance[:, None]
        lower = lower_factor((by_own[:, :, None] * weighted[:, None]).sum(axis=0) + prior)
        # Whitened by what is known of its ship, each ship is eliminated without an inverse.
        seen_by_shared = whitened(lower, (weighted[:, :, None] * by_shared[:, None]).sum(axis=0))
        slope = times(np.swapaxes(weighted, 0, 1), residual) + times(prior, own)
        own_slope = whitened(lower, slope)
        # Schur complement: what the ships leave to be known of the shared unknowns.
        trust = 1 / np.maximum(1.0, deviation.max(axis=0) / _SUSPICIOUS) ** 2
        share = roads.share * trust
        all_seen = _flat(by_shared, np.sqrt(share / variance))
        explained = _flat(seen_by_shared, np.sqrt(share))
        information = np.diag(shared_prior) + all_seen @ all_seen.T - explained @ explained.T
        shared_slope = (
            shared_prior * shared
            + all_seen @ (residual * np.sqrt(share / variance)).ravel()
            - explained @ (own_slope * np.sqrt(share)).ravel()
        )
        shared_step = -np.linalg.solve(information, shared_slope)
        own = own - unwhitened(lower, own_slope + shared_step @ seen_by_shared)
        shared = shared + shared_step
        of_shared = np.asarray(np.linalg.inv(information), dtype=np.float64)
    covariance = _covariance(lower, unwhitened(lower, seen_by_shared), of_shared)
    return Solution(own, shared, covariance, deviation.max(axis=0), hidden_m)


def _eased(shared_prior: FloatArray, shared: FloatArray) -> FloatArray:
    """Hold back (4,) less what all ships show to be farther off than it is said to be."""
    surprise = np.abs(shared) * np.sqrt(shared_prior)
    return np.asarray(shared_prior / np.maximum(1.0, surprise / _SURPRISING) ** 2)


def _of_hidden_sides(innovation: FloatArray, deviation: FloatArray) -> FloatArray:
    """Return the variances (n,) of middles whose boxes are narrower than their ships, rad^2.

    What is missing may be hidden on either side: the middle is off by half of it.
    """
    missing = np.maximum(0.0, -innovation) * np.clip(deviation - _ODD_WIDTH, 0.0, 1.0)
    return np.asarray((missing / 2) ** 2)


def _flat(slopes: FloatArray, weight: FloatArray) -> FloatArray:
    """Return slopes (3, k, n) times weights, (3, n) or (n,), as a matrix (k, 3n)."""
    weight = np.broadcast_to(weight, (len(slopes), slopes.shape[-1]))
    return np.swapaxes(slopes * weight[:, None], 0, 1).reshape(slopes.shape[1], -1)


def _covariance(lower: FloatArray, gain: FloatArray, shared: FloatArray) -> FloatArray:
    """Return the covariances (7, 7, n) of each ship's unknowns and the shared ones."""
    count = lower.shape[-1]
    covariance = np.empty((3 + SHARED, 3 + SHARED, count))
    white = whitened(lower, np.broadcast_to(np.eye(3)[..., None], (3, 3, count)))
    covariance[:3, :3] = (white[:, :, None] * white[:, None]).sum(axis=0) + carried(gain, shared)
    covariance[3:, 3:] = shared[..., None]
    covariance[:3, 3:] = -(shared @ gain)
    covariance[3:, :3] = np.swapaxes(covariance[:3, 3:], 0, 1)
    return covariance


def times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply matrices (k, m, n) with as many vectors (m, n)."""
    return np.asarray((matrices * vectors).sum(axis=1))


def _scale(
    roads: Roads,
    variance: FloatArray,
    residual: FloatArray,
    by_own: FloatArray,
    own: FloatArray,
) -> FloatArray:
    """Return by how much (3, 3, n) covariances of AIS are to be rescaled to how far ships are off.

    The image shows each ship's error across the line of sight well, whatever the water does: what
    all of them show there tells how good AIS is here along the line of sight too. And how wide
    ships look tells how good headings are, those of compasses and those taken from courses apart:
    without current a course is far better than it is said to be.
    """
    scale = np.ones((3, 3, own.shape[1]))
    if not own.any():
        return scale
    right = roads.right_in_en
    of_place = roads.prior_covariance[:2, :2]
    across = (own[:2] * right).sum(axis=0)
    expected = (right * times(of_place, right)).sum(axis=0)
    squares = np.minimum(across**2 / expected, _SUSPICIOUS**2)
    place = (_PRIOR_SHIPS + roads.share @ squares) / (_PRIOR_SHIPS + roads.share.sum())
    scale[:2, :2] = place
    width = by_own[1]
    by_heading = width[2] ** 2 * roads.prior_covariance[2, 2]
    by_place = (width[:2] * times(of_place, width[:2])).sum(axis=0)
    others = by_place * place + variance[1]
    innovation = residual[1] - (width * own).sum(axis=0)
    excess = np.minimum(innovation**2, _SUSPICIOUS**2 * (by_heading + others)) - others
    for group, prior, usual, limits in (
        (roads.is_reported, *_COMPASSES),
        (~roads.is_reported, *_COURSES),
    ):
        # Each ship's square tells as much as the heading has part in it.
        told = by_heading[group] / (by_heading + others)[group] ** 2 * roads.share[group]
        heading = (prior * usual + told @ excess[group]) / (prior + told @ by_heading[group])
        scale[2, 2, group] = min(max(heading, limits[0]), limits[1])
    return scale


def _spread(
    prior_covariance: FloatArray,
    by_own: FloatArray,
    of_shared: FloatArray,
    by_shared: FloatArray,
) -> FloatArray:
    """Return by how much (3, n) AIS and what all ships share make the evidence vary, rad^2.

    A ship whose evidence is farther off cannot be reconciled with its AIS state: it is probably
    another ship, and may say little of the shared unknowns. One that only looks too wide or too
    narrow has other sizes than AIS says or is half hidden, and is not turned for it.
    """
    by_ais = sum(
        times(by_own, prior_covariance[:, unknown]) * by_own[:, unknown] for unknown in range(3)
    )
    together = (of_shared @ by_shared * by_shared).sum(axis=1)
    return np.asarray(by_ais + together)


def _linearised(
    roads: Roads, own: FloatArray, shared: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return residuals (3, n) in rad and their slopes by own unknowns (3, 3, n).

    Then the residuals' variances (3, n) by the unknown shape of the hull, and how many metres (n,)
    of the hull reach beyond the sides of the box.
    """
    forward, port = roads.turned(own[2])
    normals = roads.alpha_beta_gamma
    ahead, abeam = times(normals, forward), times(normals, port)
    full_m, full_turning = _reach(FULL_HULL, roads.sizes, ahead, abeam)
    slim_m, slim_turning = _reach(slim_outline(), roads.sizes, ahead, abeam)
    away_m = times(normals, roads.middles(own, shared) - roads.center_in_world)
    gap = away_m + slim_m + _FULLNESS * (full_m - slim_m)
    by_turn = slim_turning + _FULLNESS * (full_turning - slim_turning)
    by_turn += times(normals, roads.swung(own))
    by_own = np.concatenate([roads.by_place, roads.mixed(by_turn)[:, None]], axis=1)
    unsure = roads.shares.mixed_variances((_FULLNESS_SIGMA * (full_m - slim_m)) ** 2)
    hidden_m = np.maximum(0.0, gap[0]) + np.maximum(0.0, -gap[1])
    return roads.mixed(gap), by_own, unsure / roads.range_m**2, hidden_m


def _reach(
    outline: FloatArray, sizes: FloatArray, ahead: FloatArray, abeam: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far outlines reach (3, n) beyond their middles' planes, and that by a turn.

    What reaches farthest are the paper's extreme corners: the leftmost, the rightmost and the
    lowest point. `ahead` and `abeam` (3, n) are what a metre forward and to port does.
    """
    length, width = sizes
    # Beta is the plane of the right side: the other extreme.
    sides = np.array([[1.0], [-1.0], [1.0]])
    forward, port = sides * ahead * length, sides * abeam * width
    reach = outline[:, :1, None] * forward + outline[:, 1:, None] * port
    along, across = np.moveaxis(outline[reach.argmax(axis=0)], -1, 0)
    along, across = along * length, across * width
    return along * ahead + across * abeam, across * ahead - along * abeam
