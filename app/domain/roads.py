"""The ships of a while before a camera as arrays: what each edge of a detection says of a hull.

The gap between a hull and the plane through an edge of its detection is a sum: of where AIS has the
antenna, of shifts over the water and of what all ships share, whose parts stay the same through all
rounds, and of how the hull lies about its antenna, which turns. What a metre forward and a metre to
port do to a gap are the two parts of one complex number: a turn about the vertical multiplies it,
and its product with a point of the hull (x forward + iy to port) is the point's part of the gap
and, imaginary, how that part grows with the turn.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray, numbered
from app.domain.box_noise import USUAL_SHARE
from app.domain.camera import Camera
from app.domain.camera_spread import place_covariance, shared_covariance
from app.domain.correction import cross, edge_normals
from app.domain.detection import HALF_PIXEL
from app.domain.edge_evidence import (
    ANY_OUTLINE,
    EdgeShares,
    box_variance_px2,
    misfit_variance_px2,
)
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import state_covariances
from app.domain.hull_outline import slim_outline
from app.domain.sighting import Sighting
from app.domain.vessel_state import HeadingSource
from app.domain.waterplane import WaterPlane

ComplexArray: TypeAlias = npt.NDArray[np.complex128]

SHARED = 4  # unknowns of all ships: level_m, pitch, yaw, roll (rad)
_SIZE_M = 0.8  # AIS gives whole metres, and people enter them wrong
# Where between a slim and a full hull most hulls are, and one sigma of that.
_FULLNESS, _FULLNESS_SIGMA = 0.3, 0.27
# How much shorter than over all a ship is afloat, in share, and one sigma of that.
_OVERHANG, _OVERHANG_SIGMA = 0.035, 0.03
# Ships are about so many times as long as wide, and where one of the two is not known, the guess is
# off by this share.
_SLENDERNESS, _GUESS_SHARE = 6.0, 0.5
# Alpha, beta, gamma: beta is the plane of the right side, the gap's other extreme.
_SIDES = np.array([[1.0], [-1.0], [1.0]])


class Touching(NamedTuple):
    """What the points of hulls that touch the edges of their boxes add to the evidence, rad.

    `at_rest` (3, n) is linear: what they would add unturned, if it grew with the turn everywhere as
    it does at this one, by `turning` (3, n). `variance` (3, n), rad^2, is that of not knowing whose
    hull it is. `reach_m` (3, n) is how far beyond its antenna a hull reaches towards each plane.
    """

    at_rest: FloatArray
    turning: FloatArray
    variance: FloatArray
    reach_m: FloatArray


class Roads:
    """All sightings of a window as arrays whose last axis is the n ships; 3 kinds of evidence.

    Ships have the unknowns east_m, north_m and turn (rad, clockwise); all share level_m, pitch,
    yaw and roll (rad). Vectors are (3, n), coordinates first. Of the evidence (rad), `still` (3, n)
    is what unmoved antennas make, `used` (3, n) what counts of it; `by_place` (3, 2, n) and
    `by_shared` (3, 4, n) are its slopes; `place_to_evidence` (2, 3, n) and `by_prior_place`
    (3, 3, n) are its covariances with a place and of itself as AIS states them. `sizes` (2, n) are
    lengths and widths by AIS, 0 where it knows none, and `spans_m` those that hulls may have.
    """

    def __init__(
        self, camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
    ) -> None:
        plane = WaterPlane.of([sighting.candidate.segment for sighting in sightings])
        states = [sighting.candidate.state for sighting in sightings]
        boxes = np.array([sighting.detection.edges_px for sighting in sightings])
        self.forward, self.port, self.up = _ships_last(plane.vessel_axes_in_world)
        # Lines of sight count from the centre of the first pixel.
        normals = _ships_last(edge_normals(camera, boxes - HALF_PIXEL, self.up.T))
        self.alpha_beta_gamma, self.delta = normals[:3], normals[3]
        self.center_in_world = camera.center_in_world[:, None]
        self.focal_px = sqrt(camera.intrinsics.K[0, 0] * camera.intrinsics.K[1, 1])
        self.box_sigma_px = settings.box_sigma_px
        self.enu = _ships_last(plane.enu_axes_in_world)
        self.antenna = _ships_last(plane.antenna_in_world)
        ends = [(s.to_bow_m, s.to_port_m, s.to_stern_m, s.to_starboard_m) for s in states]
        before, behind = np.array(ends).T.reshape(2, 2, -1)
        self.sizes = before + behind
        length, width = self.sizes
        guesses = np.array([width * _SLENDERNESS, length / _SLENDERNESS])
        self.spans_m = np.where(self.sizes > 0, self.sizes, guesses)
        # A ship turns about its antenna, whose place AIS tells.
        self.ahead_m, self.aport_m = (before - behind) / 2
        away = plane.middles_in_world.T - self.center_in_world
        self.range_m = np.sqrt((away**2).sum(axis=0))
        right = cross(away.T, plane.vessel_axes_in_world[:, 2]).T
        self.right = right / np.sqrt((right**2).sum(axis=0))
        # How far a ship lies to the right of the camera's axis: a roll lifts it by as much.
        self.aside_m = camera.R_cam_from_world[0] @ away
        self.cut = np.array([(s.cut.left, s.cut.right, s.cut.bottom) for s in sightings]).T
        self.size_px = (boxes[:, 2:] - boxes[:, :2]).T
        self.by_boxes, self.by_hulls = self._evidence_variances()
        self._weigh_planes()
        self.prior_covariance = state_covariances(states)
        self.prior_covariance[:2, :2] += place_covariance(camera)[..., None]
        by_prior = self.prior_covariance[:2, :2]
        self.place_to_evidence = np.einsum("ijn,ejn->ien", by_prior, self.by_place)
        self.by_prior_place = np.einsum("ein,ifn->efn", self.by_place, self.place_to_evidence)
        self.right_in_en = times(self.enu[:2], self.right)
        self.across_variance = (self.right_in_en * times(by_prior, self.right_in_en)).sum(axis=0)
        self.shared_covariance = shared_covariance(camera, settings)
        reported = np.array([state.heading_source == HeadingSource.REPORTED for state in states])
        self.by_heading_source = np.array([reported, ~reported], dtype=np.float64)
        # The error of a ship's AIS is one, however many images show it.
        self.vessel = numbered([state.identifier for state in states])
        self.share = 1 / np.bincount(self.vessel)[self.vessel]
        self.are_seen_again = bool((self.share < 1).any())

    def _evidence_variances(self) -> tuple[FloatArray, FloatArray]:
        """Return the variances of the evidence in rad^2: by boxes (2, 3, n), by hulls (3, n).

        By boxes: by what is usual of pixels, and of shares of the box. By hulls: by sizes too.
        """
        px_per_m = self.focal_px / self.range_m
        one_side = self.cut[0] | self.cut[1]
        pixels = np.full_like(self.size_px, self.box_sigma_px**2)
        shares = (USUAL_SHARE * self.size_px) ** 2
        by_boxes = box_variance_px2(np.array([pixels, shares]).swapaxes(0, 1), one_side)
        by_hulls = misfit_variance_px2(self.size_px, px_per_m, one_side, ANY_OUTLINE)
        guessed_m = (np.where(self.sizes > 0, 0.0, self.spans_m)).sum(axis=0)
        by_hulls[1] += (_SIZE_M**2 + (_GUESS_SHARE * guessed_m) ** 2) * px_per_m**2
        return by_boxes.swapaxes(0, 1) / self.focal_px**2, by_hulls / self.focal_px**2

    def _weigh_planes(self) -> None:
        """Say what metres in all directions do to the evidence, through the gaps to the planes."""
        shares = EdgeShares.of(~self.cut)
        self.used = shares.used
        weights = shares.weights() / self.range_m
        east, north, _ = self.enu
        directions = np.empty((3, 7, len(self.range_m)))
        for number, direction in enumerate(
            (east, north, self.up, self.right, self.antenna - self.center_in_world)
        ):
            directions[:, number] = direction
        directions[:, 5], directions[:, 6] = self.forward, self.port
        gaps = np.einsum("pcn,ckn->pkn", self.alpha_beta_gamma, directions)
        evidence = np.einsum("epn,pkn->ekn", weights, gaps[:, :5])
        self.by_place, self.still = evidence[:, :2], evidence[:, 4]
        self.by_shared = evidence[:, [2, 2, 3, 2]]
        self.by_shared[:, 1:3] *= self.range_m
        self.by_shared[:, 3] *= self.aside_m
        self._by_point = _SIDES * (gaps[:, 5] - 1j * gaps[:, 6])
        self._weights = weights.astype(np.complex128)
        self._weights[:, 1] *= _SIDES[1]
        self._variance_weights = weights**2
        # Of points x + iy: a turned hull's directions are multiplied by what it spans.
        self._antenna_point = self.ahead_m + 1j * self.aport_m
        self._spans = np.ascontiguousarray(self.spans_m.T)
        self._facing = self._spans * (1.0, -1.0)

    def touching(self, turn_rad: FloatArray) -> Touching:
        """Find what of hulls turned clockwise (n,) touches the edges of their boxes.

        These are the paper's extreme corners, the leftmost, the rightmost and the lowest point, of
        outlines between a slim hull's and a full one's.
        """
        by_point = self._by_point * np.exp(-1j * turn_rad)
        facing = by_point.view(np.float64).reshape(3, -1, 2) * self._facing
        outline = slim_outline()
        farthest = (facing.reshape(-1, 2) @ outline.T).argmax(axis=1)
        slim = outline.take(farthest, axis=0).reshape(facing.shape) * self._spans
        slim_point, fuller = _points(slim), _points(np.copysign(self._spans / 2, facing) - slim)
        apart_m2 = (_FULLNESS_SIGMA * (fuller * by_point).real) ** 2
        touching = slim_point + _FULLNESS * fuller
        # Afloat a ship is shorter than over all: the lower edge sees bow or stern farther inside.
        overhang = touching[2].real
        apart_m2[2] += (_OVERHANG_SIGMA * overhang * by_point[2].real) ** 2
        touching[2] -= _OVERHANG * overhang
        beyond_m = (touching + self._antenna_point) * by_point
        evidence = (self._weights * beyond_m).sum(axis=1)
        return Touching(
            at_rest=evidence.real - evidence.imag * turn_rad,
            turning=evidence.imag,
            variance=(self._variance_weights * apart_m2).sum(axis=1),
            reach_m=beyond_m.real,
        )

    def hidden_m(self, own: FloatArray, shared: FloatArray, touching: Touching) -> FloatArray:
        """Return how many metres (n,) of hulls reach beyond the sides of their boxes."""
        away = self.antennas(own, shared) - self.center_in_world
        sides = times(self.alpha_beta_gamma[:2], away) * _SIDES[:2] + touching.reach_m[:2]
        return np.asarray(np.maximum(0.0, sides).sum(axis=0))

    def turned(self, turn_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forward and port (3, n) after a clockwise turn (n,)."""
        cos, sin = np.cos(turn_rad), np.sin(turn_rad)
        return cos * self.forward - sin * self.port, sin * self.forward + cos * self.port

    def antennas(self, own: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the antennas (3, n) as the camera shows them."""
        level_m, pitch, yaw, roll = shared
        lifted = level_m + pitch * self.range_m + roll * self.aside_m
        moved = own[0] * self.enu[0] + own[1] * self.enu[1]
        return np.asarray(self.antenna + moved + lifted * self.up + yaw * self.range_m * self.right)

    def swung(self, own: FloatArray) -> FloatArray:
        """Return how far the middles (3, n) move by a turn (rad) about their antennas."""
        forward, port = self.turned(own[2])
        return np.asarray(self.aport_m * forward - self.ahead_m * port)


def times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply matrices (k, m, n) with as many vectors (m, n)."""
    return np.asarray((matrices * vectors).sum(axis=1))


def _ships_last(rows: FloatArray) -> FloatArray:
    """Return arrays (n, ...) with the ships on their last axis."""
    return np.ascontiguousarray(rows.transpose(*range(1, rows.ndim), 0))


def _points(along_across: FloatArray) -> ComplexArray:
    """Return x and y (..., 2) as x + iy."""
    return along_across.view(np.complex128)[..., 0]
