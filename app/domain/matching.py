"""Which detection shows which vessel: a minimum-weight bipartite matching.

Paper, Matching AIS data with 2D detection results: a detection and the enclosing rectangle of a
vessel's plane segment belong together when their centres, lower edges and widths agree. The cost
theta sums these, normalised by the image's size and divided by the detection's score; the cheapest
assignment of all pairs is taken as a whole, and only then are pairs above a maximum cost dropped.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import cut_edges
from app.domain.camera import Intrinsics
from app.domain.candidates import Candidate
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings

# Stands for an impossible pair: larger than any sum of real costs, and still exact in a double.
_IMPOSSIBLE = 1e9


class Cost(NamedTuple):
    """The paper's theta of one pair with its terms: shares of the image's width or height.

    `width` is None where widths are not compared.
    """

    center_x: float
    bottom: float
    width: float | None
    score: float

    @property
    def total(self) -> float:
        """Theta (paper, theta_cases): infinite for a score of 0."""
        distance = 2 * self.center_x + self.bottom + (self.width or 0.0)
        return distance / self.score if self.score > 0 else float("inf")

    def terms(self) -> dict[str, float]:
        """Name the terms that count, for people to read."""
        terms = {"center_x": self.center_x, "bottom": self.bottom, "score": self.score}
        return terms if self.width is None else {**terms, "width": self.width}


class Pair(NamedTuple):
    """A detection and a candidate (positions in the lists given), with their cost."""

    detection: int
    candidate: int
    cost: Cost


def matching_cost(
    detection: Detection, candidate: Candidate, image: Intrinsics, border_tolerance_px: float
) -> Cost:
    """Compare a detection with a vessel's WP_ais (paper, equations delta_centre_x to theta_cases).

    Widths are not compared when the left or right border cuts the detection, nor for a vessel
    without known size, which can be matched by its position only.
    """
    x1, _, x2, y2 = candidate.rectangle_px
    compare_widths = candidate.has_size and not (
        cut_edges(detection, image, border_tolerance_px).sideways
    )
    width_gap = abs((detection.x2_px - detection.x1_px) - (x2 - x1)) / image.width_px
    return Cost(
        center_x=float(
            abs((detection.x1_px + detection.x2_px) / 2 - (x1 + x2) / 2) / image.width_px
        ),
        bottom=float(abs(detection.y2_px - y2) / image.height_px),
        width=float(width_gap) if compare_widths else None,
        score=detection.score,
    )


def match(
    detections: Sequence[Detection],
    candidates: Sequence[Candidate],
    image: Intrinsics,
    settings: FusionSettings,
) -> list[Pair]:
    """Assign each detection at most one vessel and the reverse, at the least total cost.

    The maximum cost is left to the caller, who has to tell "no detection left" from "too unlike".
    Detections below the score threshold take no part. Pairs come in the order of detections.
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - keeps the web process small

    taking_part = [i for i, d in enumerate(detections) if d.score >= settings.score_threshold]
    if not taking_part or not candidates:
        return []
    boxes = [detections[i] for i in taking_part]
    weights = _totals(boxes, candidates, image, settings.border_tolerance_px)
    rows, columns = linear_sum_assignment(np.minimum(weights, _IMPOSSIBLE))
    return [
        Pair(
            taking_part[row],
            column,
            matching_cost(boxes[row], candidates[column], image, settings.border_tolerance_px),
        )
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True)
    ]


def _totals(
    detections: Sequence[Detection],
    candidates: Sequence[Candidate],
    image: Intrinsics,
    border_tolerance_px: float,
) -> FloatArray:
    """Return theta of all pairs, (detections, candidates), as `matching_cost` has it of one."""
    x1, _, x2, y2 = np.array([one.edges_px for one in detections]).T[..., None]
    left, _, right, bottom = np.array([one.rectangle_px for one in candidates]).T
    has_size = np.array([one.has_size for one in candidates])
    is_cut = np.array([cut_edges(one, image, border_tolerance_px).sideways for one in detections])
    width = np.abs((x2 - x1) - (right - left)) / image.width_px
    width[is_cut] = 0.0
    width[:, ~has_size] = 0.0
    center_x = np.abs((x1 + x2) / 2 - (left + right) / 2) / image.width_px
    distance = 2 * center_x + np.abs(y2 - bottom) / image.height_px + width
    score = np.array([one.score for one in detections])[:, None]
    totals: FloatArray = np.full(distance.shape, np.inf)
    np.divide(distance, score, out=totals, where=score > 0)
    return totals
