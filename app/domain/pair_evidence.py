"""What the images of a while say of each pair of a box and a vessel, before anyone decides.

For every box and every vessel that may be it: where its middle, width and lower edge are against
those of the hull that AIS leads to expect, how sure that is, and what it means if the box shows
nothing with AIS.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, sqrt

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray, numbered
from app.domain.camera import Camera
from app.domain.camera_spread import shared_covariance
from app.domain.edge_evidence import EdgeShares
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import HullEdges
from app.domain.priors import Priors, logit
from app.domain.seen_boxes import Scene, SeenBoxes

_HOPELESS_SIGMAS = 10.0
_OUTWARDS = np.array([[-1.0], [1.0], [1.0]])  # of left, right and lower edge
_ODDS_OF_UNIT = log(0.05)  # that boxes side by side are one unit


@dataclass(frozen=True, eq=False)
class PairEvidence:
    """All p pairs worth a thought: where each belongs, and its evidence in pixels.

    Those of an image stand together, `bounds` are where one image's end and another's begin.
    `row` (p,) counts the boxes of all images, `vessel` (p,) the vessels, `prior` (p,) is the log
    odds of the pair before looking. Evidence (3, p) are middle, width and lower edge, `used` (3, p)
    which of them count, `counted` (p,) how many; `own_covariance` (3, 3, p) is that of AIS state,
    hull and detection together, `by_shared` (3, 3, p) the slopes by water level, pitch and yaw,
    `background` (p,) the log density of the evidence where the detection is no vessel with AIS.
    """

    boxes: SeenBoxes
    scene: IntArray
    bounds: Sequence[int]
    row: IntArray
    candidate: IntArray
    vessel: IntArray
    residual: FloatArray
    used: BoolArray
    own_covariance: FloatArray
    by_shared: FloatArray
    background: FloatArray
    prior: FloatArray
    counted: IntArray

    @classmethod
    def of(
        cls, camera: Camera, scenes: Sequence[Scene], settings: FusionSettings
    ) -> "PairEvidence | None":
        """Compare all boxes with all hulls near them; None where there are none."""
        boxes = SeenBoxes.of(scenes, camera, settings)
        candidates = [candidate for scene in scenes for candidate in scene.candidates]
        if not boxes.all or not candidates:
            return None
        hulls = HullEdges.of(camera, candidates)
        counts = [len(scene.candidates) for scene in scenes]
        row, column = boxes.pairs_with(np.repeat(np.arange(len(scenes)), counts))
        near = _near(boxes, hulls, row, column, sqrt(shared_covariance(camera, settings)[2, 2]))
        row, column = row[near], column[near]
        if not len(row):
            return None
        shares = _shares(boxes, hulls, row, column)
        used = shares.used
        half = shares.mixed(hulls.covariance_px2.take(column, axis=2))
        own = shares.mixed(half.swapaxes(0, 1))
        # What does not count is expected exactly: it changes neither distances nor volumes.
        of_each = np.einsum("iin->in", own)
        of_each += np.where(used, boxes.variance(hulls, row, column), 1.0)
        scene = boxes.scene[row]
        place = np.concatenate([np.arange(count) for count in counts])
        vessel = numbered(candidate.state.identifier for candidate in candidates)
        return cls(
            boxes=boxes,
            scene=scene,
            bounds=[0, *(np.flatnonzero(scene[1:] != scene[:-1]) + 1).tolist(), len(scene)],
            row=row,
            candidate=place[column],
            vessel=vessel[column],
            residual=shares.mixed(
                boxes.edges_px.take(row, axis=1) - hulls.edges_px.take(column, axis=1)
            ),
            used=used,
            own_covariance=own,
            by_shared=shares.mixed(hulls.by_shared.take(column, axis=2)),
            background=boxes.background(camera, row, used),
            prior=_odds_before_looking(boxes, settings)[row],
            counted=used.sum(axis=0),
        )


def _near(
    boxes: SeenBoxes, hulls: HullEdges, row: IntArray, column: IntArray, yaw_sigma: float
) -> BoolArray:
    """Return which pairs (p,) overlap sideways within ten sigmas: the others are hopeless."""
    sigma = np.sqrt(np.einsum("iin->in", hulls.covariance_px2)[:2])
    turn = yaw_sigma * hulls.by_shared[0, 2, 0]
    reach = _HOPELESS_SIGMAS * (sigma + turn + boxes.edge_sigma_px)
    # A hull beyond the lens's range has no edges, which is near nothing.
    is_shown = np.isfinite(hulls.edges_px).all(axis=0)
    left = np.where(is_shown, hulls.edges_px[0] - reach[0], np.nan)
    right = hulls.edges_px[1] + reach[1]
    width = boxes.size_px[0]
    first, last = boxes.edges_px[0] - width, boxes.edges_px[1] + width
    return np.asarray((left[column] <= last[row]) & (right[column] >= first[row]))


def _shares(boxes: SeenBoxes, hulls: HullEdges, row: IntArray, column: IntArray) -> EdgeShares:
    """Return how edges make up the evidence of pairs, and which count.

    A detection cut by the border says nothing of that edge if the hull goes on beyond it; a hull
    that should end inside of the image contradicts it.
    """
    outside = hulls.edges_px.take(column, axis=1) - boxes.edges_px.take(row, axis=1)
    beyond = outside * _OUTWARDS >= 0
    return EdgeShares.of(~(boxes.cut.take(row, axis=1) & beyond), hulls.has_size[column])


def _odds_before_looking(boxes: SeenBoxes, settings: FusionSettings) -> FloatArray:
    """Return the log odds (n,) of a pair of each box: detected at all, against without AIS."""
    before = Priors(settings.unidentified_per_image, settings.detected_share)
    odds = np.full(len(boxes.all), before.log_odds(0.5))
    odds[boxes.is_unit] += _ODDS_OF_UNIT
    if settings.score_weight:
        of_score = np.array([logit(box.score) for box in boxes.all]) - settings.score_center
        odds += settings.score_weight * of_score
    return odds
