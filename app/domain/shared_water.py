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

from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.box_noise import BoxNoise, Learnt, Surprises, box_noise, scatter
from app.domain.covariances import Factors, apart, carried, factored, inverse, together
from app.domain.roads import SHARED, Roads, Touching, times

ROUNDS = 5
_LISTENING = (1, 3)  # the rounds that ask how exact boxes are: not before ships have moved
# Evidence more than so many sigmas off counts less for what all ships share.
_SUSPICIOUS = 2.5
_ODD_WIDTH = 1.0  # and widths more than this, to say how a ship heads
# The stated accuracy of AIS counts as much as what so many ships show of it.
_PRIOR_SHIPS = 4.0
# The same of headings, of compasses and of courses: as how many ships the usual scale counts, that
# scale, and its limits. An exact compass is not to be turned by the shapes of hulls. Two of three
# ships of recorded traffic head within 0.45 sigmas of their course, many well within.
_PRIOR_HEADINGS, _USUAL_SCALES, _LEAST_SCALES, _LARGEST_SCALES = np.array(
    [[3.0, 1.0, 0.25, 1.5], [4.0, 0.1, 0.02, 4.0]]
).T
# A lower edge this many sigmas above where it should be may be another ship's bulwark.
_HIDDEN_BELOW = 1.5
# Beyond so many sigmas what all ships share is held back less and less: it may be worse than said.
_SURPRISING = 1.5


@dataclass(frozen=True, eq=False)
class Solution:
    """Unknowns of the ships (3, n), the shared ones (4,), and the covariances of all (7, 7, n).

    `deviation` (n,) is by how many sigmas the image contradicts AIS most, `hidden_m` (n,) how much
    of the ship's breadth across the line of sight is beyond the sides of its detection. `box_noise`
    is how far off boxes are expected to be.
    """

    own: FloatArray
    shared: FloatArray
    covariance: FloatArray
    deviation: FloatArray
    hidden_m: FloatArray
    box_noise: BoxNoise


def solve(roads: Roads) -> Solution:
    """Find the most probable places, turns and shared unknowns."""
    own, shared = np.zeros((3, len(roads.share))), np.zeros(SHARED)
    by_shared, of_shared = roads.by_shared, roads.shared_covariance
    of_shared_before = inverse(of_shared), np.sqrt(of_shared.diagonal())
    # The slopes by what all share, and last what is off whatever that is.
    evidence = np.concatenate([by_shared, roads.still[:, None]], axis=1)
    noise, trust = Learnt(), roads.share
    wider, ease = np.zeros_like(roads.range_m), np.ones_like(roads.range_m)
    for number in range(ROUNDS):
        before = own, shared
        touching = roads.touching(own[2])
        np.add(roads.still, touching.at_rest, out=evidence[:, SHARED])
        innovation = evidence[:, SHARED] + shared @ by_shared
        by_hulls = roads.by_hulls + touching.variance
        variance = noise.believed.of(roads.by_boxes) + by_hulls
        scale, turn_variance = _rescaled(roads, own, touching, innovation[1], variance[1])
        with_turn = turn_variance * touching.turning
        spread = scale * roads.by_prior_place + with_turn[:, None] * touching.turning
        of_each = np.einsum("iin->in", spread)
        by_water = (of_shared @ by_shared * by_shared).sum(axis=1)
        by_states = of_each + by_water
        if number in _LISTENING:
            # What all share was found from this evidence, which is the less off for that.
            left = np.maximum(0.2, 1 - by_water / (variance + of_each))
            noise = _box_noise(roads, innovation / np.sqrt(left), by_hulls + of_each, trust)
            variance = noise.believed.of(roads.by_boxes) + by_hulls
        deviation = _doubted(variance, innovation, np.sqrt(variance + by_states))
        of_each += variance
        trust = roads.share / np.maximum(1.0, deviation / _SUSPICIOUS) ** 2
        factors, free, told = _told(spread, evidence, trust)
        prior = _eased(*of_shared_before, shared)
        of_shared = inverse(prior + told[:SHARED, :SHARED])
        shared = -(of_shared @ told[:SHARED, SHARED])
        off = (free[:, SHARED] + shared @ free[:, :SHARED]) / factors.variances
        off = together(factors, off)
        own = np.empty_like(own)
        own[:2] = -scale * times(roads.place_to_evidence, off)
        # A ship is narrowest bow on; turned beyond, its width turns it back: smaller steps then.
        ease *= np.where(touching.turning[1] * wider < 0, 0.5, 1.0)
        wider = touching.turning[1]
        own[2] = before[0][2] - ease * ((with_turn * off).sum(axis=0) + before[0][2])
    # Errors are as large as boxes are expected to be off, not as the evidence was weighed.
    of_each += noise.expected.of(roads.by_boxes) - noise.believed.of(roads.by_boxes)
    factors, free, told = _told(spread, evidence, trust)
    of_shared = inverse(prior + told[:SHARED, :SHARED])
    to_evidence = np.concatenate([scale * roads.place_to_evidence, with_turn[None]])
    prior_covariance = roads.prior_covariance.copy()
    prior_covariance[:2, :2] *= scale
    prior_covariance[2, 2] = turn_variance
    covariance = _covariance(prior_covariance, to_evidence, factors, free, of_shared)
    hidden_m = roads.hidden_m(*before, touching)
    return Solution(own, shared, covariance, deviation, hidden_m, noise.expected)


def _told(
    spread: FloatArray, evidence: FloatArray, trust: FloatArray
) -> tuple[Factors, FloatArray, FloatArray]:
    """Return what evidence (3, 5, n) tells of what all ships share: information (5, 5).

    With the ships' own unknowns as part of the `spread` (3, 3, n) only the shared ones are left.
    Its factors and the evidence that varies apart come first.
    """
    factors = factored(spread)
    free = apart(factors, evidence)
    told = (free * (trust / factors.variances)[:, None] @ free.swapaxes(1, 2)).sum(axis=0)
    return factors, free, told


def _box_noise(
    roads: Roads, innovation: FloatArray, by_others: FloatArray, trust: FloatArray
) -> Learnt:
    """Return how far off boxes are, by evidence (3, n), its variance by all else, and trust (n,).

    Middles tell nothing: AIS is farther off than any box. Nor do widths by themselves, which depend
    on shapes and sizes: but how those of a ship vary from image to image is the detector's.
    """
    _, wide, low = roads.used
    lower = Surprises(innovation[2, low], roads.by_boxes[:, 2, low], by_others[2, low], trust[low])
    if not roads.are_seen_again:
        return box_noise([lower])
    range_m = roads.range_m[wide]
    varying = scatter(
        roads.vessel[wide], innovation[1, wide] * range_m, roads.by_boxes[:, 1, wide] * range_m**2
    )
    return box_noise([lower, varying])


def _doubted(variance: FloatArray, innovation: FloatArray, sigma: FloatArray) -> FloatArray:
    """Widen variances (3, n) where evidence is off by more than one `sigma` (3, n) explains.

    Returns by how many sigmas (n,) a ship's evidence is off most. What is missing of a width may be
    hidden on either side: the middle is off by half of it. A lower edge too high may be hidden.
    """
    off = innovation / sigma
    deviation = np.abs(off)
    width = deviation[1]
    share = np.minimum(np.maximum(width - _ODD_WIDTH, 0.0), 1.0)
    variance[0] += (np.maximum(0.0, -innovation[1]) * share / 2) ** 2
    variance[1] *= np.maximum(1.0, width / _ODD_WIDTH) ** 2
    variance[2] *= np.maximum(1.0, off[2] / _HIDDEN_BELOW) ** 2
    return np.asarray(deviation.max(axis=0))


def _eased(information: FloatArray, sigma: FloatArray, shared: FloatArray) -> FloatArray:
    """Hold back less what all ships show to be farther off than `information` (4, 4) says."""
    ease = np.maximum(1.0, np.abs(shared) / (_SURPRISING * sigma))
    return np.asarray(information / (ease[:, None] * ease))


def _covariance(
    prior: FloatArray,
    to_evidence: FloatArray,
    factors: Factors,
    free: FloatArray,
    of_shared: FloatArray,
) -> FloatArray:
    """Return the covariances (7, 7, n) of each ship's unknowns and the shared ones.

    From the prior of the ships' own (3, 3, n), its covariance with the evidence (3, 3, n), and the
    shared slopes where the evidence varies apart.
    """
    covariance = np.empty((3 + SHARED, 3 + SHARED, prior.shape[-1]))
    told = apart(factors, to_evidence.swapaxes(0, 1))
    gain = told / factors.variances[:, None]
    by_shared = np.einsum("ein,ekn->ikn", gain, free[:, :SHARED])
    own = prior - np.einsum("ein,ejn->ijn", told, gain)
    covariance[:3, :3] = own + carried(by_shared, of_shared)
    covariance[3:, 3:] = of_shared[..., None]
    covariance[:3, 3:] = -(of_shared @ by_shared)
    covariance[3:, :3] = covariance[:3, 3:].swapaxes(0, 1)
    return covariance


def _rescaled(
    roads: Roads, own: FloatArray, touching: Touching, innovation: FloatArray, variance: FloatArray
) -> tuple[float, FloatArray]:
    """Return by how much covariances of places are rescaled, and variances (n,) of headings, rad^2.

    The image shows each ship's error across the line of sight well, whatever the water does: what
    all of them show there tells how good AIS is here along the line of sight too. And how wide
    ships look (`innovation` and its `variance`, (n,)) tells how good headings are, those of
    compasses and those taken from courses apart: without current a course is far better than it is
    said to be.
    """
    stated, sources = roads.prior_covariance[2, 2], roads.by_heading_source
    usual = _USUAL_SCALES @ sources
    if not own.any():
        return 1.0, stated * usual
    across = (own[:2] * roads.right_in_en).sum(axis=0)
    squares = np.minimum(across**2 / roads.across_variance, _SUSPICIOUS**2)
    place = float((_PRIOR_SHIPS + roads.share @ squares) / (_PRIOR_SHIPS + roads.share.sum()))
    by_heading = touching.turning[1] ** 2 * stated
    others = roads.by_prior_place[1, 1] * place + variance
    expected = by_heading + others
    # Each ship's square tells as much as the heading has part in it.
    told = by_heading / expected**2 * roads.share
    most = _SUSPICIOUS**2 * (usual * by_heading + others)
    excess = np.minimum(innovation**2, most) - others
    scales = (_PRIOR_HEADINGS * _USUAL_SCALES + sources @ (told * excess)) / (
        _PRIOR_HEADINGS + sources @ (told * by_heading)
    )
    scales = np.minimum(np.maximum(scales, _LEAST_SCALES), _LARGEST_SCALES)
    return place, stated * (scales @ sources)
