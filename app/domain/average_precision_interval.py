"""How sure an average precision is: images drawn anew, with replacement, many times (Efron 1979).

Detections of one image are not independent of each other (the same haze, the same quay), so whole
images are drawn. Nothing is matched again: an image that is drawn twice counts twice. The draws
come from a fixed seed, so the same data has the same interval every time it is asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.average_precision import RECALL_LEVELS, Outcome

DRAWS = 100
SEED = 1979
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PrecisionIntervals:
    """95 % intervals (percentiles 2.5 and 97.5) of COCO's figures over all sizes."""

    ap: Interval
    ap50: Interval
    ar100: Interval


def precision_intervals(
    outcome: Outcome, draws: int = DRAWS, seed: int = SEED
) -> PrecisionIntervals | None:
    """Draw the images anew; None where no box is to be found, or only one image was looked at."""
    images = len(outcome.wanted)
    if images < 2 or not outcome.wanted.sum():
        return None
    random = np.random.default_rng(seed)
    rows = [
        _Row(np.flatnonzero(right), ignored if ignored.any() else None)
        for right, ignored in zip(outcome.is_right, outcome.is_ignored, strict=True)
    ]
    figures = np.array(
        [
            _drawn(
                outcome, rows, np.bincount(random.integers(images, size=images), minlength=images)
            )
            for _ in range(draws)
        ]
    )
    low, high = np.nanpercentile(figures, [2.5, 97.5], axis=0)
    ap, ap50, ar100 = ((float(one), float(other)) for one, other in zip(low, high, strict=True))
    return PrecisionIntervals(ap, ap50, ar100)


class _Row(NamedTuple):
    """Of a threshold: where the right detections stand, and which are ignored, None for none."""

    right: IntArray
    ignored: BoolArray | None


def _drawn(outcome: Outcome, rows: Sequence[_Row], times: IntArray) -> tuple[float, float, float]:
    """Return AP, AP at 0.5 and AR with each image counted so many times."""
    boxes = float(times @ outcome.wanted)
    if not boxes:
        return np.nan, np.nan, np.nan
    weight = times[outcome.image].astype(np.float64)
    everything = np.cumsum(weight)
    averages, recalls = [], []
    for right, ignored in rows:
        counted = everything if ignored is None else np.cumsum(np.where(ignored, 0.0, weight))
        found = np.cumsum(weight[right])
        averages.append(_average(found, counted[right], boxes))
        recalls.append(found[-1] / boxes if len(found) else 0.0)
    return float(np.mean(averages)), averages[0], float(np.mean(recalls))


def _average(found: FloatArray, counted: FloatArray, boxes: float) -> float:
    """Average the precision over the levels of recall; only right detections ever raise either."""
    precisions = np.divide(found, counted, out=np.zeros_like(found), where=counted > 0)
    precisions = np.maximum.accumulate(precisions[::-1])[::-1]
    at = np.searchsorted(found / boxes, RECALL_LEVELS, side="left")
    return float(precisions[at[at < len(found)]].sum() / len(RECALL_LEVELS))
