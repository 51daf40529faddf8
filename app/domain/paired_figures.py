"""Figures of two runs over the same images, and how sure their difference is.

Two runs over one set of images share what is hard about it: fog, a crowd, a vessel without AIS. So
their difference is surer than the two intervals side by side suggest. Images are drawn anew with
replacement, the same ones for both runs, and the figure of each is worked out anew (Efron 1979);
95 % of the differences lie in the interval. Whole images are drawn, because what one image shows is
not independent. The draws follow from a seed: the same rows give the same interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

DRAWS, SEED = 400, 1979
_AT_ONCE = 50  # draws whose sorted values are held in memory together
Counts = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Side:
    """A run's figure: its value (None where undefined) and how many units it rests on."""

    value: float | None
    count: int


@dataclass(frozen=True, slots=True)
class PairedFigure:
    """A figure of two runs; `difference` is run minus other, with its 95 % interval.

    The interval is None where more than one draw in twenty leaves either figure undefined.
    """

    other: Side
    run: Side
    difference: float | None
    interval: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Sums:
    """What a share or a mean is made of, by image (n,): sums of the units, and how many there are.

    A share's sums count the units that have the property.
    """

    sums: FloatArray
    counts: FloatArray


@dataclass(frozen=True, slots=True)
class Values:
    """Values (m,) and the image, 0 to n - 1, each belongs to (m,)."""

    values: FloatArray
    images: npt.NDArray[np.intp]


def drawn_images(images: int) -> Counts:
    """Return how often each image is drawn, (draws, images); each row sums up to `images`."""
    random = np.random.default_rng(SEED)
    if not images:
        return np.zeros((DRAWS, 0), dtype=np.int64)
    return random.multinomial(images, np.full(images, 1 / images), size=DRAWS)


def paired_ratio(other: Sums, run: Sums, drawn: Counts) -> PairedFigure:
    """Compare shares or means of two runs over the same images (n,), drawn as told (draws, n)."""
    return _paired(
        Side(_ratio(other), int(other.counts.sum())),
        Side(_ratio(run), int(run.counts.sum())),
        _ratios(run, drawn) - _ratios(other, drawn),
    )


def paired_median(other: Values, run: Values, drawn: Counts) -> PairedFigure:
    """Compare medians of two runs' values over the same images, drawn as told (draws, n)."""
    return _paired(
        Side(_median(other.values), len(other.values)),
        Side(_median(run.values), len(run.values)),
        _medians(run, drawn) - _medians(other, drawn),
    )


def sums_by_image(values: Sequence[float], images: Sequence[int], count: int) -> Sums:
    """Return the sums of values by image, 0 to `count` - 1."""
    place = np.asarray(images, dtype=np.intp)
    return Sums(
        np.bincount(place, np.asarray(values, dtype=np.float64), count).astype(np.float64),
        np.bincount(place, minlength=count).astype(np.float64),
    )


def _paired(other: Side, run: Side, differences: FloatArray) -> PairedFigure:
    if other.value is None or run.value is None:
        return PairedFigure(other, run, None, None)
    defined = differences[np.isfinite(differences)]
    interval = None
    if len(defined) >= 0.95 * DRAWS:
        low, high = np.percentile(defined, [2.5, 97.5])
        interval = (float(low), float(high))
    return PairedFigure(other, run, run.value - other.value, interval)


def _ratio(sums: Sums) -> float | None:
    count = float(sums.counts.sum())
    return float(sums.sums.sum()) / count if count else None


def _ratios(sums: Sums, drawn: Counts) -> FloatArray:
    tops, counts = drawn @ sums.sums, drawn @ sums.counts
    ratios = np.full(len(drawn), np.nan)
    np.divide(tops, counts, out=ratios, where=counts > 0)
    return ratios


def _median(values: FloatArray) -> float | None:
    return float(np.median(values)) if len(values) else None


def _medians(one: Values, drawn: Counts) -> FloatArray:
    """Return the median of each draw (draws,): of values repeated as often as their image is."""
    found = np.full(len(drawn), np.nan)
    if not len(one.values):
        return found
    order = np.argsort(one.values, kind="stable")
    values, images = one.values[order], one.images[order]
    for start in range(0, len(drawn), _AT_ONCE):
        upto = np.cumsum(drawn[start : start + _AT_ONCE, images], axis=1)
        for row, heights in enumerate(upto):
            total = int(heights[-1])
            if total:
                # Of an even number the two in the middle count, as everywhere.
                middle = np.searchsorted(heights, [(total + 1) // 2, total // 2 + 1])
                found[start + row] = values[middle].mean()
    return found
