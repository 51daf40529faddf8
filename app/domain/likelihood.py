"""Which detection shows which vessel, by how probable each explanation of the images is.

The published cost adds pixels to pixels: an error of 40 px counts the same at 100 m, where AIS is
far better, and at 2 km, where it is far worse. Here a pair is judged by the probability of the
detection's edges given the AIS state with its uncertainty, against two explanations that need no
pair at all: a vessel without AIS (or nothing) made the detection, and the detector overlooked the
vessel. All detections and vessels of an image are explained together, as cheaply as can be.

Vessels of a viewport share the height of the water and the small error of the camera's rotation.
Both are estimated from the pairs over all images of a while and the pairs are made again: what is
left of a lower edge's error is then small, and the order of ranges tells vessels apart.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.camera import Camera
from app.domain.camera_spread import shared_covariance
from app.domain.candidates import Candidate
from app.domain.covariances import apart, carried, factored, inverse
from app.domain.detection import Detection
from app.domain.explanation import explained
from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.image_series import series_tracks, split_series
from app.domain.pair_evidence import PairEvidence
from app.domain.priors import CERTAINTY
from app.domain.seen_boxes import Scene
from app.domain.student import log_student
from app.domain.track_votes import Voices, vote

ROUNDS = 3
_SUSPICIOUS_SIGMAS = 2.0
_MOSTLY = 0.5
# Signs of what goes together of level, pitch and yaw: here a pitch moves lower edges down.
_DOWNWARDS = np.outer((1.0, -1.0, 1.0), (1.0, -1.0, 1.0))


class Odds(NamedTuple):
    """Why a detection is taken for a vessel: log odds against "no AIS" and "not detected".

    The deviations of middle, width and lower edge are in sigmas of what was expected, None where
    the image's border hides them. `probability` is that of this vessel for this detection among
    all candidates and none.
    """

    log_odds: float
    probability: float
    middle_sigmas: float | None
    width_sigmas: float | None
    bottom_sigmas: float | None

    @property
    def total(self) -> float:
        """A cost: the more negative, the surer; 0 is no better than no pair."""
        return -self.log_odds

    def terms(self) -> dict[str, float]:
        """Name what counted, for people to read."""
        terms = {"probability": self.probability}
        if self.middle_sigmas is not None:
            terms["middle_sigmas"] = self.middle_sigmas
        if self.width_sigmas is not None:
            terms["width_sigmas"] = self.width_sigmas
        if self.bottom_sigmas is not None:
            terms["bottom_sigmas"] = self.bottom_sigmas
        return terms


class LikelyPair(NamedTuple):
    """A detection and a candidate of an image (positions in the lists given), with their odds.

    `box` is the detection's own, or that around all hulls of a unit, of which `detection` is the
    one with the antenna.
    """

    detection: int
    candidate: int
    cost: Odds
    box: Detection


def match_by_likelihood(
    camera: Camera,
    scenes: Sequence[Scene],
    settings: FusionSettings,
    times_s: Sequence[float] | None = None,
) -> list[list[LikelyPair]]:
    """Match all images of one viewport and one time window; pairs of each, by detection.

    Detections below the score threshold take no part. With matching `track_votes` the images come
    in the order of their `times_s`.
    """
    pairing = PairEvidence.of(camera, scenes, settings)
    chosen: list[list[LikelyPair]] = [[] for _ in scenes]
    if pairing is None:
        return chosen
    prior = _DOWNWARDS * shared_covariance(camera, settings)[:3, :3]
    information = inverse(prior)
    shared, covariance = np.zeros(3), prior
    taken: IntArray = np.zeros(0, dtype=np.intp)
    for _ in range(ROUNDS):
        shared, covariance = _shared(pairing, taken, shared, covariance, information)
        judged = _judge(pairing, shared, covariance)
        worth = judged.gain + pairing.prior
        taken = explained(pairing, worth)
    if settings.matching is MatchingMethod.TRACK_VOTES and times_s is not None:
        worth, allowed = _voted(pairing, worth, times_s, settings)
        taken = explained(pairing, np.where(allowed, worth, -np.inf))
    for index, odds in zip(taken.tolist(), _odds(pairing, judged, worth, taken), strict=True):
        scene = int(pairing.scene[index])
        chosen[scene].append(_pair(pairing, index, odds, scenes[scene], camera))
    return [sorted(pairs, key=lambda pair: pair.detection) for pairs in chosen]


def _voted(
    pairing: PairEvidence, worth: FloatArray, times_s: Sequence[float], settings: FusionSettings
) -> tuple[FloatArray, BoolArray]:
    """Let the tracks of each series vote: log odds of all pairs (p,), and which may be made."""
    allowed = np.ones(len(worth), dtype=bool)
    in_unit = _in_better_unit(pairing, worth)
    for series in split_series(times_s, settings.series_gap_s):
        found = series_tracks(pairing.boxes, series, times_s)
        tracks = [track for track in found if not in_unit[list(track.rows)].mean() > _MOSTLY]
        worth, here = vote(Voices(pairing.row, pairing.vessel, worth), tracks)
        allowed &= here
    return worth, allowed


def _in_better_unit(pairing: PairEvidence, worth: FloatArray) -> BoolArray:
    """Return which boxes (n,) explain less by themselves than as a hull of a unit."""
    boxes = pairing.boxes
    best = np.zeros(len(boxes.all))
    np.maximum.at(best, pairing.row, worth)
    as_hull = np.zeros(len(boxes.all))
    for unit in np.flatnonzero(boxes.is_unit & (best > 0)):
        here = np.flatnonzero((boxes.scene == boxes.scene[unit]) & ~boxes.is_unit)
        hulls = [row for row in here.tolist() if boxes.members[row][0] in boxes.members[int(unit)]]
        as_hull[hulls] = np.maximum(as_hull[hulls], best[unit])
    return np.asarray(as_hull > best)


@dataclass(frozen=True, eq=False)
class _Judged:
    """Log likelihood ratios (p,) against the background.

    `off` (3, p) are deviations, whose variances are the diagonals of `expected` (3, 3, p).
    """

    gain: FloatArray
    off: FloatArray
    expected: FloatArray

    def sigmas(self, taken: IntArray) -> FloatArray:
        """Return by how many sigmas (3, t) some pairs deviate."""
        variances = np.einsum("iin->in", self.expected).take(taken, axis=1)
        return np.asarray(np.abs(self.off.take(taken, axis=1)) / np.sqrt(variances))


def _judge(pairing: PairEvidence, shared: FloatArray, covariance: FloatArray) -> _Judged:
    """Compare the evidence of all pairs with what AIS and the shared unknowns lead to expect."""
    expected = pairing.own_covariance + carried(pairing.by_shared, covariance)
    off = pairing.residual - shared @ pairing.by_shared
    density = log_student(off, expected, pairing.counted)
    return _Judged(density - pairing.background, off, expected)


def _shared(
    pairing: PairEvidence,
    taken: IntArray,
    shared: FloatArray,
    covariance: FloatArray,
    prior: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Estimate water level, pitch and yaw (3,) with their covariance from the pairs taken.

    A pair that deviates much counts less; the error of a vessel's AIS is one in all its images.
    """
    if not len(taken):
        return shared, covariance
    slopes = pairing.by_shared.take(taken, axis=2)
    residual = pairing.residual.take(taken, axis=1)
    own = pairing.own_covariance.take(taken, axis=2)
    spread = factored(own + carried(slopes, covariance))
    off = apart(spread, residual - shared @ slopes)
    counted = np.maximum(1, pairing.counted[taken])
    deviation = np.sqrt((off**2 / spread.variances).sum(axis=0) / counted)
    vessel = pairing.vessel[taken]
    weight = 1 / np.bincount(vessel)[vessel]
    weight /= np.maximum(1.0, deviation / _SUSPICIOUS_SIGMAS) ** 2
    factors = factored(own)
    evidence = apart(factors, np.concatenate([slopes, residual[:, None]], axis=1))
    counts = weight / factors.variances
    told = (evidence * counts[:, None] @ evidence.swapaxes(1, 2)).sum(axis=0)
    found = inverse(prior + told[:-1, :-1])
    return found @ told[:-1, -1], found


def _probabilities(pairing: PairEvidence, worth: FloatArray, taken: IntArray) -> FloatArray:
    """Return how probable some pairs are among all vessels for their boxes, and none."""
    tempered = CERTAINTY * worth
    every = np.zeros(len(pairing.boxes.all))
    np.logaddexp.at(every, pairing.row, tempered)
    return np.asarray(np.exp(tempered[taken] - every[pairing.row[taken]]))


def _odds(
    pairing: PairEvidence, judged: _Judged, worth: FloatArray, taken: IntArray
) -> Iterator[Odds]:
    """Say how sure some pairs are, and why."""
    for log_odds, probability, sigmas, used in zip(
        worth[taken].tolist(),
        _probabilities(pairing, worth, taken).tolist(),
        judged.sigmas(taken).T.tolist(),
        pairing.used[:, taken].T.tolist(),
        strict=True,
    ):
        told = [one if counts else None for one, counts in zip(sigmas, used, strict=True)]
        yield Odds(log_odds, probability, *told)


def _pair(
    pairing: PairEvidence, index: int, odds: Odds, scene: Scene, camera: Camera
) -> LikelyPair:
    """Name the two ends of a pair."""
    row, candidate = int(pairing.row[index]), int(pairing.candidate[index])
    members = pairing.boxes.members[row]
    return LikelyPair(
        detection=_with_antenna(scene, members, scene.candidates[candidate], camera),
        candidate=candidate,
        cost=odds,
        box=pairing.boxes.all[row],
    )


def _with_antenna(
    scene: Scene, members: Sequence[int], candidate: Candidate, camera: Camera
) -> int:
    """Return the hull of a unit in which the antenna is: the one that is under way with AIS."""
    if len(members) == 1:
        return members[0]
    (antenna,) = camera.project(candidate.segment.antenna_in_world[None])
    hulls = [scene.detections[index] for index in members]
    beside = [max(h.x1_px - antenna[0], antenna[0] - h.x2_px) for h in hulls]
    return members[int(np.argmin(beside))]
