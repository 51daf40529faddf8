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
from app.domain.borders import cut_edges
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.detection import HALF_PIXEL, Detection
from app.domain.edge_evidence import edge_mixing, edge_variance_px2
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import HullEdges

ROUNDS = 3
_UNKNOWN_SIZE_SHARE = 0.25  # where AIS gives no size, the middle may be anywhere near the middle
# AIS errs more often by several sigmas than a normal distribution has it: Student's t.
_FREEDOM = 6.0
# A detection that is no vessel with AIS: anywhere on the water, of a size of 5 to 200 m.
_WATER_SHARE = 0.5  # of the image's height
_SIZES = log(40.0)
_HOPELESS_SIGMAS = 10.0
_SUSPICIOUS_SIGMAS = 2.0


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
    """A detection and a candidate of an image (positions in the lists given), with their odds."""

    detection: int
    candidate: int
    cost: Odds


@dataclass(frozen=True, eq=False)
class Scene:
    """What is to be matched in one image: detections that take part, and the candidates."""

    detections: Sequence[Detection]
    candidates: Sequence[Candidate]


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
        taken = _assigned(pairing, judged.gain, settings)
        shared, covariance = _shared(pairing, taken, shared, covariance, np.linalg.inv(prior))
    for index in taken:
        chosen[pairing.scene[index]].append(_pair(pairing, judged, int(index), settings))
    return [sorted(pairs, key=lambda pair: pair.detection) for pairs in chosen]


@dataclass(frozen=True, eq=False)
class _Pairing:
    """All p pairs worth a thought: where each belongs, and its evidence in pixels.

    Evidence (p, 3) are middle, width and lower edge, `used` (p, 3) which of them count;
    `own_covariance` (p, 3, 3) is that of AIS state, hull and detection together, `by_shared`
    (p, 3, 3) the slopes by water level, pitch and yaw, `background` (p,) the log density of the
    evidence where the detection is no vessel with AIS.
    """

    scene: IntArray
    detection: IntArray
    candidate: IntArray
    vessel: Sequence[str]
    residual: FloatArray
    used: BoolArray
    own_covariance: FloatArray
    by_shared: FloatArray
    background: FloatArray

    @classmethod
    def of(
        cls, camera: Camera, scenes: Sequence[Scene], settings: FusionSettings
    ) -> "_Pairing | None":
        rows = [
            (number, index, detection)
            for number, scene in enumerate(scenes)
            for index, detection in enumerate(scene.detections)
            if detection.score >= settings.score_threshold
        ]
        columns = [
            (number, index, candidate)
            for number, scene in enumerate(scenes)
            for index, candidate in enumerate(scene.candidates)
        ]
        if not rows or not columns:
            return None
        hulls = HullEdges.of(camera, [candidate for _, _, candidate in columns])
        boxes = _Boxes.of([detection for _, _, detection in rows], camera, settings)
        of_row, of_column = (np.array([one[0] for one in ends]) for ends in (rows, columns))
        row, column = np.nonzero(of_row[:, None] == of_column)
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
            scene=of_row[row],
            detection=np.array([index for _, index, _ in rows])[row],
            candidate=np.array([index for _, index, _ in columns])[column],
            vessel=[columns[index][2].state.identifier for index in column],
            residual=(mixing @ (boxes.edges_px[row] - hulls.edges_px[column])[..., None])[..., 0],
            used=used,
            own_covariance=own,
            by_shared=mixing @ hulls.by_shared[column],
            background=boxes.background(camera, row, used),
        )


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Detections as arrays: left, right, lower edges (n, 3), sizes (n, 2), which are cut (n, 3)."""

    edges_px: FloatArray
    size_px: FloatArray
    cut: BoolArray
    edge_sigma_px: float

    @classmethod
    def of(
        cls, detections: Sequence[Detection], camera: Camera, settings: FusionSettings
    ) -> "_Boxes":
        edges = np.array([(d.x1_px, d.x2_px, d.y2_px) for d in detections]) - HALF_PIXEL
        cuts = [cut_edges(d, camera.intrinsics, settings.border_tolerance_px) for d in detections]
        return cls(
            edges_px=edges,
            size_px=np.array([(d.x2_px - d.x1_px, d.y2_px - d.y1_px) for d in detections]),
            cut=np.array([(cut.left, cut.right, cut.bottom) for cut in cuts]),
            edge_sigma_px=settings.box_sigma_px,
        )

    def variance(self, hulls: HullEdges, row: IntArray, column: IntArray) -> FloatArray:
        """Return the variances (p, 3) of middle, width and lower edge, px^2."""
        one_side = self.cut[row, 0] | self.cut[row, 1]
        variance = edge_variance_px2(
            self.edge_sigma_px, self.size_px[row], hulls.px_per_m[column], one_side
        )
        unsized = ~hulls.has_size[column]
        variance[unsized, 0] += (_UNKNOWN_SIZE_SHARE * self.size_px[row[unsized], 0]) ** 2
        return variance

    def background(self, camera: Camera, row: IntArray, used: BoolArray) -> FloatArray:
        """Return the log density (p,) of the evidence where there is no vessel with AIS."""
        image = camera.intrinsics
        spread = np.column_stack(
            [
                np.full(len(row), log(image.width_px)),
                np.log(np.maximum(self.size_px[row, 0], 1.0) * _SIZES),
                np.full(len(row), log(_WATER_SHARE * image.height_px)),
            ]
        )
        return np.asarray(-(spread * used).sum(axis=1))


def _near(
    boxes: _Boxes, hulls: HullEdges, row: IntArray, column: IntArray, rotation_sigma_deg: float
) -> BoolArray:
    """Return which pairs (p,) overlap sideways within ten sigmas: the others are hopeless."""
    sigma = np.sqrt(hulls.covariance_px2[column][:, [0, 1], [0, 1]])
    turn = radians(rotation_sigma_deg) * hulls.by_shared[0, 0, 2]
    reach = _HOPELESS_SIGMAS * (sigma + turn + boxes.edge_sigma_px) + boxes.size_px[row, :1]
    left = hulls.edges_px[column, 0] - reach[:, 0] <= boxes.edges_px[row, 1]
    right = hulls.edges_px[column, 1] + reach[:, 1] >= boxes.edges_px[row, 0]
    return np.asarray(left & right & np.isfinite(hulls.edges_px[column]).all(axis=1))


def _mixing(
    boxes: _Boxes, hulls: HullEdges, row: IntArray, column: IntArray
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


def _assigned(pairing: _Pairing, gain: FloatArray, settings: FusionSettings) -> IntArray:
    """Return the pairs, by index, of the most probable explanation of each image."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - keeps the web process small

    worth = gain + _odds_of_pairs(settings)
    taken = []
    ends = np.flatnonzero(np.diff(pairing.scene, append=-1)) + 1
    for first, last in zip([0, *ends[:-1]], ends, strict=True):
        # A pair is worth making where it beats both of its ends being left alone.
        good = first + np.flatnonzero(worth[first:last] > 0)
        if not len(good):
            continue
        rows, row = np.unique(pairing.detection[good], return_inverse=True)
        columns, column = np.unique(pairing.candidate[good], return_inverse=True)
        matrix = np.zeros((len(rows), len(columns)))
        matrix[row, column] = -worth[good]
        number = np.full(matrix.shape, -1)
        number[row, column] = good
        found = number[linear_sum_assignment(matrix)]
        taken.append(found[found >= 0])
    return np.concatenate(taken) if taken else np.zeros(0, dtype=np.intp)


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


def _pair(pairing: _Pairing, judged: _Judged, index: int, settings: FusionSettings) -> LikelyPair:
    """Say how sure one pair is."""
    rivals = (pairing.scene == pairing.scene[index]) & (
        pairing.detection == pairing.detection[index]
    )
    worth = judged.gain[rivals] + _odds_of_pairs(settings)
    own = float(judged.gain[index] + _odds_of_pairs(settings))
    others = float(np.logaddexp.reduce([0.0, *worth]))
    sigmas = [
        float(abs(value)) if used else None
        for value, used in zip(judged.sigmas[index], pairing.used[index], strict=True)
    ]
    odds = Odds(own, float(np.exp(own - others)), *sigmas)
    return LikelyPair(int(pairing.detection[index]), int(pairing.candidate[index]), odds)
