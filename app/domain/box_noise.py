"""How exact the boxes of a detector are here, learnt from the ships they show.

Detectors differ: one's edges are off by a pixel, another's by a fiftieth of the box, and whoever
starts a run hardly ever knows. But ships tell: lower edges of those far away differ from what AIS
leads to expect by more than AIS and the water explain, and a ship seen several times is wider in
one image than in the next. Against what is usual of detectors this is weighed on a small grid.

A score of ships does not settle it, and what is left open counts in two ways: evidence is best
weighed by the middle of what is probable, but errors are as large as the mean variance, which the
poorer detectors that are still possible raise.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from app.domain.arrays import FloatArray, IntArray

# What is usual: the given number of pixels and this share of the box. Most detectors are a little
# better and some far worse: the middle of the logarithms, and one sigma of each.
USUAL_SHARE = 0.008
_LOG_MIDDLE, _LOG_SIGMAS = -0.4, np.array([0.8, 1.1])
_STEPS = np.linspace(-2.0, 2.0, 7)
# Student's t, since a hidden ship or a wrong size is no evidence of poor boxes: its freedom, and by
# what a variance enters its square for errors that are normal after all.
_FREEDOM, _NORMAL = 6.0, 4.6

_GRID = np.stack(np.meshgrid(_STEPS, _STEPS), axis=-1).reshape(-1, 2)
_PRIOR = -(_GRID**2).sum(axis=1) / 2
_LOG_FACTORS = _LOG_MIDDLE + _LOG_SIGMAS * _GRID
_VARIANCE_FACTORS = np.exp(2 * _LOG_FACTORS)


class BoxNoise(NamedTuple):
    """By what the usual variances of edges are to be multiplied: pixels, and share of the size."""

    pixels: float = 1.0
    share: float = 1.0

    def of(self, usual: FloatArray) -> FloatArray:
        """Return variances (...) of usual ones (2, ...) by pixels and by share."""
        return np.asarray(self.pixels * usual[0] + self.share * usual[1])


class Learnt(NamedTuple):
    """How far off boxes are: to weigh evidence by, and to say by how far errors are expected."""

    believed: BoxNoise = BoxNoise()
    expected: BoxNoise = BoxNoise()


class Surprises(NamedTuple):
    """What n pieces of evidence are off by, and why: variances by boxes (2, n), and by all else.

    `weight` (n,) is how much each counts.
    """

    off: FloatArray
    by_boxes: FloatArray
    by_others: FloatArray
    weight: FloatArray


def box_noise(surprises: Sequence[Surprises]) -> Learnt:
    """Return how far off boxes probably are; about what is usual where nothing is seen."""
    off, by_boxes, by_others, weight = (
        np.concatenate(parts, axis=-1) for parts in zip(*surprises, strict=True)
    )
    variance = _VARIANCE_FACTORS @ by_boxes + by_others
    square = off**2 / (variance * _NORMAL)
    log_odds = _PRIOR - (np.log(variance) + (_FREEDOM + 1) * np.log1p(square)) @ weight / 2
    odds = np.exp(log_odds - log_odds.max())
    odds /= odds.sum()
    return Learnt(
        BoxNoise(*np.exp(2 * (odds @ _LOG_FACTORS)).tolist()),
        BoxNoise(*(odds @ _VARIANCE_FACTORS).tolist()),
    )


def scatter(vessel: IntArray, off: FloatArray, by_boxes: FloatArray) -> Surprises:
    """Return how evidence (n,) of vessels differs from the mean of each: boxes alone make it so."""
    weight = 1 / by_boxes.sum(axis=0)
    count, total = np.bincount(vessel), np.bincount(vessel, weight)
    mean = np.bincount(vessel, weight * off) / np.where(count > 0, total, 1.0)
    free = 1 - 1 / count[vessel]
    several = free > 0
    return Surprises(
        (off - mean[vessel])[several] / np.sqrt(free[several]),
        by_boxes[:, several],
        np.zeros(int(several.sum())),
        free[several],
    )
