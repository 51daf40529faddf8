"""What the images of a while say of each pair of a box and a vessel, before anyone decides.

For every box and every vessel that may be it: where its middle, width and lower edge are against
those of the hull that AIS leads to expect, how sure that is, and what it means if the box shows
nothing with AIS.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, radians

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.camera import Camera
from app.domain.edge_evidence import edge_mixing
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import HullEdges
from app.domain.priors import Priors, logit
from app.domain.seen_boxes import Scene, SeenBoxes

_HOPELESS_SIGMAS = 10.0
_ODDS_OF_UNIT = log(0.05)  # that boxes side by side are one unit


@dataclass(frozen=True, eq=False)
class PairEvidence:
    """All p pairs worth a thought: where each belongs, and its evidence in pixels.

    `row` (p,) counts the boxes of all images, `prior` (p,) is the log odds of the pair before
    looking. Evidence (p, 3) are middle, width and lower edge, `used` (p, 3) which of them count;
    `own_covariance` (p, 3, 3) is that of AIS state, hull and detection together, `by_shared`
    (p, 3, 3) the slopes by water level, pitch and yaw, `background` (p,) the log density of the
    evidence where the detection is no vessel with AIS. `px_per_m` (p,) is the scale there.
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
    px_per_m: FloatArray

    @classmethod
    def of(
        cls, camera: Camera, scenes: Sequence[Scene], settings: FusionSettings
    ) -> "PairEvidence | None":
        """Compare all boxes with all hulls near them; None where there are none."""
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
        row, column = boxes.pairs_with(of_column)
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
            scene=boxes.scene[row],
            row=row,
            candidate=np.array([index for _, index, _ in columns])[column],
            vessel=[columns[index][2].state.identifier for index in column],
            residual=(mixing @ (boxes.edges_px[row] - hulls.edges_px[column])[..., None])[..., 0],
            used=used,
            own_covariance=own,
            by_shared=mixing @ hulls.by_shared[column],
            background=boxes.background(camera, row, used),
            px_per_m=hulls.px_per_m[column],
            prior=_odds_before_looking(boxes, settings)[row],
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


def _odds_before_looking(boxes: SeenBoxes, settings: FusionSettings) -> FloatArray:
    """Return the log odds (n,) of a pair of each box: detected at all, against without AIS."""
    before = Priors(settings.unidentified_per_image, settings.detected_share)
    odds = np.full(len(boxes.all), before.log_odds(0.5))
    odds[boxes.is_unit] += _ODDS_OF_UNIT
    if settings.score_weight:
        of_score = np.array([logit(box.score) for box in boxes.all]) - settings.score_center
        odds += settings.score_weight * of_score
    return odds
