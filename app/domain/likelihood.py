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

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import lgamma, log, pi, radians

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.detection import Detection
from app.domain.edge_evidence import edge_mixing
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import HullEdges
from app.domain.seen_boxes import Scene, SeenBoxes

ROUNDS = 3
# AIS errs more often by several sigmas than a normal distribution has it: Student's t.
_FREEDOM = 6.0
_HOPELESS_SIGMAS = 10.0
_SUSPICIOUS_SIGMAS = 2.0
_ODDS_OF_UNIT = log(0.05)  # that boxes side by side are one unit
_SURE_ODDS = 6.0


@dataclass(frozen=True, slots=True)
class Odds:
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
        terms = {
            "probability": self.probability,
            "middle_sigmas": self.middle_sigmas,
            "width_sigmas": self.width_sigmas,
            "bottom_sigmas": self.bottom_sigmas,
        }
        return {name: value for name, value in terms.items() if value is not None}


@dataclass(frozen=True, slots=True)
class LikelyPair:
    """A detection and a candidate of an image (positions in the lists given), with their odds.

    `box` is the detection's own, or that around all hulls of a unit, of which `detection` is the
    one with the antenna.
    """

    detection: int
    candidate: int
    cost: Odds
    box: Detection


def match_by_likelihood(
    camera: Camera, scenes: Sequence[Scene], settings: FusionSettings
) -> list[list[LikelyPair]]:
    """Match all images of one viewport and one time window; pairs of each, by detection.

    Detections below the score threshold take no part.
    """
    pairing = _Pairing.of(camera, scenes, settings)
    chosen: list[list[LikelyPair]] = [[] for _ in scenes]
    if pairing is None:
        return chosen
    rotation = radians(settings.rotation_sigma_deg)
    prior = np.diag([settings.level_sigma_m, rotation, rotation]) ** 2
    shared, covariance = np.zeros(3), prior
    for _ in range(ROUNDS):
        judged = _judge(pairing, shared, covariance)
        taken = _assigned(pairing, judged.gain)
        shared, covariance = _shared(pairing, taken, shared, covariance, np.linalg.inv(prior))
    for index in taken:
        scene = scenes[pairing.scene[index]]
        pair = _pair(pairing, judged, int(index), scene, camera)
        chosen[pairing.scene[index]].append(pair)
    return [sorted(pairs, key=lambda pair: pair.detection) for pairs in chosen]


@dataclass(frozen=True, eq=False)
class _Pairing:
    """All p pairs worth a thought: where each belongs, and its evidence in pixels.

    `row` (p,) counts the boxes of all images, `prior` (p,) is the log odds of the pair before
    looking.
    Evidence (p, 3) are middle, width and lower edge, `used` (p, 3) which of them count;
    `own_covariance` (p, 3, 3) is that of AIS state, hull and detection together, `by_shared`
    (p, 3, 3) the slopes by water level, pitch and yaw, `background` (p,) the log density of the
    evidence where the detection is no vessel with AIS.
    """

    boxes: SeenBoxes
    scene: IntArray
    row: IntArray
    candidate: IntArray
    vessel: Sequence[str]
    residual: FloatArray
    used: BoolArray
    own_covariance: FloatArray
    by_shared: FloatArray
    background: FloatArray
    prior: FloatArray

    @classmethod
    def of(
        cls, camera: Camera, scenes: Sequence[Scene], settings: FusionSettings
    ) -> "_Pairing | None":
        boxes = SeenBoxes.of(scenes, camera, settings)
        columns = [
            (number, index, candidate)
            for number, scene in enumerate(scenes)
            for index, candidate in enumerate(scene.candidates)
        ]
        if not boxes.all or not columns:
            return None
        hulls = HullEdges.of(camera, [candidate for _, _, candidate in columns])
        of_column = np.array([number for number, _, _ in columns])
        of_row = boxes.scene
        row, column = np.nonzero(of_row[:, None] == of_column)
        in_order = np.argsort(of_row[row], kind="stable")
        row, column = row[in_order], column[in_order]
        near = _near(boxes, hulls, row, column, settings.rotation_sigma_deg)
        row, column = row[near], column[near]
        if not len(row):
            return None
        mixing, used = _mixing(boxes, hulls, row, column)
        # What does not count is expected exactly: it changes neither distances nor volumes.
        noise = np.where(used, boxes.variance(hulls, row, column), 1.0)
        swapped = np.swapaxes(mixing, 1, 2)
        own = mixing @ hulls.covariance_px2[column] @ swapped
        own[:, range(3), range(3)] += noise
        return cls(
            boxes=boxes,
            scene=of_row[row],
            row=row,
            candidate=np.array([index for _, index, _ in columns])[column],
            vessel=[columns[index][2].state.identifier for index in column],
            residual=(mixing @ (boxes.edges_px[row] - hulls.edges_px[column])[..., None])[..., 0],
            used=used,
            own_covariance=own,
            by_shared=mixing @ hulls.by_shared[column],
            background=boxes.background(camera, row, used),
            prior=_odds_of_pairs(settings) + np.where(boxes.is_unit[row], _ODDS_OF_UNIT, 0.0),
        )


def _near(
    boxes: SeenBoxes, hulls: HullEdges, row: IntArray, column: IntArray, rotation_sigma_deg: float
) -> BoolArray:
    """Return which pairs (p,) overlap sideways within ten sigmas: the others are hopeless."""
    sigma = np.sqrt(hulls.covariance_px2[column][:, [0, 1], [0, 1]])
    turn = radians(rotation_sigma_deg) * hulls.by_shared[0, 0, 2]
    reach = _HOPELESS_SIGMAS * (sigma + turn + boxes.edge_sigma_px) + boxes.size_px[row, :1]
    left = hulls.edges_px[column, 0] - reach[:, 0] <= boxes.edges_px[row, 1]
    right = hulls.edges_px[column, 1] + reach[:, 1] >= boxes.edges_px[row, 0]
    return np.asarray(left & right & np.isfinite(hulls.edges_px[column]).all(axis=1))


def _mixing(
    boxes: SeenBoxes, hulls: HullEdges, row: IntArray, column: IntArray
) -> tuple[FloatArray, BoolArray]:
    """Return how edges make up middle, width and lower edge (p, 3, 3), and which count (p, 3).

    A detection cut by the border says nothing of that edge if the hull goes on beyond it; a hull
    that should end inside of the image contradicts it.
    """
    beyond = (hulls.edges_px[column] - boxes.edges_px[row]) * (-1, 1, 1) >= 0
    seen = ~(boxes.cut[row] & beyond)
    mixing = edge_mixing(seen, hulls.has_size[column])
    return mixing, np.asarray(mixing.any(axis=2))


@dataclass(frozen=True, eq=False)
class _Judged:
    """Log likelihood ratios (p,) against the background, and deviations (p, 3) in sigmas."""

    gain: FloatArray
    sigmas: FloatArray


def _judge(pairing: _Pairing, shared: FloatArray, covariance: FloatArray) -> _Judged:
    """Compare the evidence of all pairs with what AIS and the shared unknowns lead to expect."""
    slopes = pairing.by_shared
    expected = pairing.own_covariance + slopes @ covariance @ np.swapaxes(slopes, 1, 2)
    off = pairing.residual - slopes @ shared
    squares = (off * np.linalg.solve(expected, off[..., None])[..., 0]).sum(axis=1)
    volume = np.log(np.linalg.det(expected))
    count = pairing.used.sum(axis=1)
    density = _STUDENT[count] - volume / 2 - (_FREEDOM + count) / 2 * np.log1p(squares / _FREEDOM)
    return _Judged(
        gain=density - pairing.background,
        sigmas=off / np.sqrt(expected[:, range(3), range(3)]),
    )


_STUDENT = np.array(
    [
        lgamma((_FREEDOM + count) / 2) - lgamma(_FREEDOM / 2) - count / 2 * log(_FREEDOM * pi)
        for count in range(4)
    ]
)


def _assigned(pairing: _Pairing, gain: FloatArray) -> IntArray:
    """Return the pairs, by index, of the most probable explanation of each image."""
    worth = gain + pairing.prior
    taken = []
    ends = np.flatnonzero(np.diff(pairing.scene, append=-1)) + 1
    for first, last in zip([0, *ends[:-1]], ends, strict=True):
        # A pair is worth making where it beats both of its ends being left alone.
        good = first + np.flatnonzero(worth[first:last] > 0)
        if len(good):
            taken.append(_explained(pairing, worth, good))
    return np.concatenate(taken) if taken else np.zeros(0, dtype=np.intp)


def _explained(pairing: _Pairing, worth: FloatArray, good: IntArray) -> IntArray:
    """Return which of the good pairs of one image explain it best, no box in two of them.

    Of two boxes that share a detection, or of which one may be a part of the other, the one with
    the less probable pair is left out, and the rest is explained anew.
    """
    boxes = pairing.boxes
    while len(good):
        found = _cheapest(pairing, worth, good)
        row = pairing.row[found]
        clash = boxes.clashes[np.ix_(row, row)] & ~np.eye(len(row), dtype=bool)
        # What may be a part shows another vessel only where that is sure.
        part = boxes.part_of[np.ix_(row, row)] & (worth[found] < _SURE_ODDS)[:, None]
        one, other = np.nonzero(clash | part)
        if not len(one):
            return found
        both = np.concatenate([one, other])
        worst = row[both[np.argmin(worth[found][both])]]
        good = good[pairing.row[good] != worst]
    return good


def _cheapest(pairing: _Pairing, worth: FloatArray, good: IntArray) -> IntArray:
    """Return the pairs of the assignment with the largest worth together."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - keeps the web process small

    rows, row = np.unique(pairing.row[good], return_inverse=True)
    columns, column = np.unique(pairing.candidate[good], return_inverse=True)
    matrix = np.zeros((len(rows), len(columns)))
    matrix[row, column] = -worth[good]
    number = np.full(matrix.shape, -1)
    number[row, column] = good
    found = number[linear_sum_assignment(matrix)]
    return np.asarray(found[found >= 0])


def _odds_of_pairs(settings: FusionSettings) -> float:
    """Return the log odds of any pair before looking: detected at all, against without AIS."""
    detected = settings.detected_share
    return log(detected / (1 - detected)) - log(settings.unidentified_per_image)


def _shared(
    pairing: _Pairing,
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
    slopes, residual = pairing.by_shared[taken], pairing.residual[taken]
    own = pairing.own_covariance[taken]
    off = residual - slopes @ shared
    expected = own + slopes @ covariance @ np.swapaxes(slopes, 1, 2)
    squares = (off * np.linalg.solve(expected, off[..., None])[..., 0]).sum(axis=1)
    deviation = np.sqrt(squares / np.maximum(1, pairing.used[taken].sum(axis=1)))
    images = Counter(pairing.vessel[index] for index in taken)
    weight = np.array([1 / images[pairing.vessel[index]] for index in taken])
    weight /= np.maximum(1.0, deviation / _SUSPICIOUS_SIGMAS) ** 2
    weighted = np.swapaxes(slopes, 1, 2) @ np.linalg.inv(own) * weight[:, None, None]
    found = np.linalg.inv(prior + (weighted @ slopes).sum(axis=0))
    return found @ (weighted @ residual[..., None]).sum(axis=0)[:, 0], found


def _pair(
    pairing: _Pairing, judged: _Judged, index: int, scene: Scene, camera: Camera
) -> LikelyPair:
    """Say how sure one pair is."""
    boxes, row = pairing.boxes, pairing.row[index]
    worth = judged.gain + pairing.prior
    rivals = pairing.row == row
    others = float(np.logaddexp.reduce([0.0, *worth[rivals]]))
    sigmas = [
        float(abs(value)) if used else None
        for value, used in zip(judged.sigmas[index], pairing.used[index], strict=True)
    ]
    own = float(worth[index])
    candidate = int(pairing.candidate[index])
    return LikelyPair(
        detection=_with_antenna(scene, boxes.members[row], scene.candidates[candidate], camera),
        candidate=candidate,
        cost=Odds(own, float(np.exp(own - others)), *sigmas),
        box=boxes.all[row],
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
