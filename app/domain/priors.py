"""What a site's own graded images say of chances that hold before looking at any box.

Matching weighs each pair against two explanations that need none: the box shows nothing with AIS,
the vessel was overlooked. How often that is so differs from port to port and from detector to
detector, and only people who looked know it. The numbers are shrunk towards what runs take anyway,
so that ten images change little and a thousand decide.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import log

import numpy as np

from app.domain.arrays import FloatArray

# Edges of boxes, hulls and AIS err together, so that log odds are worth half of what they would be
# if each erred by itself: measured on traffic of errors beyond what is stated.
CERTAINTY = 0.5
_PRIOR_IMAGES = 5.0  # so many images, or vessels, with the numbers that runs take anyway
_USUAL_UNIDENTIFIED = 1.0
_USUAL_DETECTED = 0.8
_SLOPE_SIGMA = 0.7
_FEWEST_OF_A_KIND = 20  # boxes with AIS, and without, before scores tell anything
_LARGEST_SLOPE = 3.0
_FEWEST_WRONG = 8  # pairs by the published cost, before a limit of it is told
_COSTS = (0.05, 2.0)


@dataclass(frozen=True, slots=True)
class GradedBox:
    """A detection of a graded image, and the vessel with AIS that it shows, if any."""

    score: float
    mmsi: int | None


@dataclass(frozen=True, slots=True)
class GradedPair:
    """A match and whether it was right; `probability` is what matching said, None for `paper`.

    `cost` is theta, or minus the log odds where there is a probability.
    """

    score: float
    mmsi: int
    cost: float
    probability: float | None
    right: bool


@dataclass(frozen=True, slots=True)
class Priors:
    """Chances before looking, as runs take them; None where the images say nothing of it."""

    unidentified_per_image: float = _USUAL_UNIDENTIFIED
    detected_share: float = _USUAL_DETECTED
    score_weight: float = 0.0
    score_center: float = 0.0
    maximum_cost: float | None = None

    def log_odds(self, score: float) -> float:
        """Return the log odds of any pair of a box with this score."""
        share = self.detected_share
        of_score = self.score_weight * (logit(score) - self.score_center)
        return log(share / (1 - share)) - log(self.unidentified_per_image) + of_score

    def as_settings(self) -> dict[str, float]:
        """Return the settings of a run that they are."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True)
class GradedImage:
    """An image of which every visible vessel is accounted for, as a run with `used` saw it.

    `not_detected` vessels have AIS and no box, `silent` ones no AIS; `visible` counts all.
    """

    id: int
    at_s: float
    used: Priors
    boxes: Sequence[GradedBox]
    pairs: Sequence[GradedPair]
    not_detected: int
    silent: int
    visible: int


def fit_priors(images: Sequence[GradedImage], without: frozenset[int] = frozenset()) -> Priors:
    """Fit all chances to graded images, leaving out what they show of some vessels."""
    boxes = [box for image in images for box in image.boxes if box.mmsi not in without]
    with_ais = sum(box.mmsi is not None for box in boxes)
    none = len(boxes) - with_ais
    missed = sum(image.not_detected for image in images)
    weight, center = _score_calibration(boxes)
    return Priors(
        unidentified_per_image=(none + _PRIOR_IMAGES * _USUAL_UNIDENTIFIED)
        / (len(images) + _PRIOR_IMAGES),
        detected_share=(with_ais + _PRIOR_IMAGES * _USUAL_DETECTED)
        / (with_ais + missed + _PRIOR_IMAGES),
        score_weight=weight,
        score_center=center,
        maximum_cost=_maximum_cost(
            [pair for image in images for pair in image.pairs if pair.mmsi not in without]
        ),
    )


def logit(score: float) -> float:
    """Return a score as log odds, kept away from certainty."""
    inside = min(max(score, 0.01), 0.99)
    return log(inside / (1 - inside))


def _score_calibration(boxes: Sequence[GradedBox]) -> tuple[float, float]:
    """Return by how much the log odds rise with a score's logit, and where they are even.

    Logistic regression with a normal prior on the slope; 0 where the boxes are too few to tell, or
    where low scores would speak for a vessel.
    """
    shows = np.array([box.mmsi is not None for box in boxes], dtype=np.float64)
    kinds = (int(shows.sum()), int(len(shows) - shows.sum()))
    if min(kinds) < _FEWEST_OF_A_KIND:
        return 0.0, 0.0
    x = np.column_stack([np.ones(len(boxes)), [logit(box.score) for box in boxes]])
    penalty = np.diag([0.0, 1 / _SLOPE_SIGMA**2])
    beta = np.zeros(2)
    for _ in range(30):
        chance = 1 / (1 + np.exp(-x @ beta))
        slope = x.T @ (shows - chance) - penalty @ beta
        curve = (x * (chance * (1 - chance))[:, None]).T @ x + penalty
        beta = beta + np.linalg.solve(curve, slope)
    weight = min(float(beta[1]), _LARGEST_SLOPE)
    if weight <= 0:
        return 0.0, 0.0
    return weight, (log(kinds[0] / kinds[1]) - float(beta[0])) / weight


def _maximum_cost(pairs: Sequence[GradedPair]) -> float | None:
    """Return the limit of the published cost with the fewest errors: wrong kept, right lost."""
    published = [pair for pair in pairs if pair.probability is None]
    right = np.array([pair.right for pair in published], dtype=bool)
    if min((~right).sum(), right.sum()) < _FEWEST_WRONG:
        return None
    cost = np.array([pair.cost for pair in published])
    order = np.argsort(cost)
    # Below each border all are kept: errors are the wrong among them and the right above.
    kept_wrong = np.concatenate([[0], np.cumsum(~right[order])])
    lost_right = right.sum() - np.concatenate([[0], np.cumsum(right[order])])
    best = int(np.argmin(kept_wrong + lost_right))
    ends: FloatArray = np.concatenate([[_COSTS[0]], cost[order], [_COSTS[1]]])
    return float(np.clip((ends[best] + ends[best + 1]) / 2, *_COSTS))
