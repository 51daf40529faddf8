"""How far reviewers agree, beyond what chance alone would bring.

Percent agreement flatters: where nine poses in ten are Good, two people who grade blindly agree on
most. Cohen's kappa (1960) takes two people's own habits out of it; Krippendorff's alpha (2011) does
so for any number of people of whom each saw only some units, and can weigh how far apart two grades
stand. Ordinal alpha takes the scale Good, OK, Bad, Wrong as an order: Good against Wrong is a worse
quarrel than Good against OK. All figures are 1 for full agreement and 0 for none beyond chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from math import isfinite, sqrt

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.sampling import Z_95

Ratings = Sequence[Sequence[int]]
"""One entry a unit: the categories (0 up to the number of categories) its raters gave."""


class Scale(StrEnum):
    """Whether categories merely differ, or stand in an order."""

    NOMINAL = "nominal"
    ORDINAL = "ordinal"


@dataclass(frozen=True, slots=True)
class Kappa:
    """Cohen's kappa of two raters; None where it is not defined (no units, or one grade only).

    Full agreement has no interval: its formula would give one of no width.
    """

    units: int
    agreed: int
    kappa: float | None
    interval: tuple[float, float] | None


def cohens_kappa(pairs: Sequence[tuple[int, int]], categories: int) -> Kappa:
    """Return Cohen's kappa with its 95 % interval (Fleiss, Cohen and Everitt 1969, eq. 13)."""
    table = np.zeros((categories, categories))
    for first, second in pairs:
        table[first, second] += 1
    units, agreed = len(pairs), int(np.trace(table))
    if not units:
        return Kappa(0, 0, None, None)
    p = table / units
    rows, columns = p.sum(axis=1), p.sum(axis=0)
    seen, by_chance = float(np.trace(p)), float(rows @ columns)
    if by_chance >= 1.0:
        return Kappa(units, agreed, None, None)
    kappa = (seen - by_chance) / (1 - by_chance)
    # How each cell pulls at kappa: on the diagonal for it, elsewhere against it.
    sums = rows[None, :] + columns[:, None]
    pull = -((1 - kappa) * sums)
    pull[np.diag_indices(categories)] += 1.0
    variance = float((p * pull**2).sum()) - (kappa - by_chance * (1 - kappa)) ** 2
    if variance <= 1e-12:  # full agreement: the formula knows no doubt, however few units there are
        return Kappa(units, agreed, kappa, None)
    reach = Z_95 * sqrt(variance / units) / (1 - by_chance)
    return Kappa(units, agreed, kappa, (max(-1.0, kappa - reach), min(1.0, kappa + reach)))


def percent_agreement(ratings: Ratings) -> float | None:
    """Return the share of pairs of ratings of one unit that are equal; None without any pair."""
    equal = pairs = 0
    for unit in ratings:
        for first, second in combinations(unit, 2):
            pairs += 1
            equal += first == second
    return equal / pairs if pairs else None


def krippendorffs_alpha(ratings: Ratings, categories: int, scale: Scale) -> float | None:
    """Return Krippendorff's alpha; units with fewer than two ratings do not count.

    None where it is not defined: no unit was rated twice, or all ratings are one category.
    """
    alphas = _alphas(_coincidences(ratings, categories).sum(axis=0)[None], scale)
    return float(alphas[0]) if isfinite(alphas[0]) else None


def alpha_interval(
    ratings: Ratings, categories: int, scale: Scale, *, rounds: int = 1000, seed: int = 1
) -> tuple[float, float] | None:
    """Return alpha's 95 % interval by drawing units with replacement; None with under two units.

    The draws are seeded, so that a page that is looked at twice says the same twice.
    """
    matrices = _coincidences(ratings, categories).reshape(-1, categories**2)
    units = len(matrices)
    if units < 2:
        return None
    # Units that were rated alike are alike: drawing how often each kind comes is the same, and
    # takes no longer for thousands of units than for ten.
    kinds, counts = np.unique(matrices, axis=0, return_counts=True)
    draws = np.random.default_rng(seed).multinomial(units, counts / units, size=rounds)
    alphas = _alphas((draws @ kinds).reshape(rounds, categories, categories), scale)
    alphas = alphas[np.isfinite(alphas)]
    if not len(alphas):
        return None
    low, high = np.quantile(alphas, [0.025, 0.975])
    return float(low), float(high)


def _coincidences(ratings: Ratings, categories: int) -> FloatArray:
    """Return each unit's coincidence matrix (units, categories, categories) (Krippendorff)."""
    counts = np.array(
        [np.bincount(unit, minlength=categories) for unit in ratings if len(unit) > 1],
        dtype=np.float64,
    ).reshape(-1, categories)
    pairs = counts[:, :, None] * counts[:, None, :]
    pairs[:, np.arange(categories), np.arange(categories)] -= counts
    return np.asarray(pairs / (counts.sum(axis=1) - 1)[:, None, None], dtype=np.float64)


def _alphas(coincidences: FloatArray, scale: Scale) -> FloatArray:
    """Return alpha for each summed coincidence matrix (n, k, k); not finite where undefined."""
    totals = coincidences.sum(axis=2)
    count = totals.sum(axis=1)
    apart = _distances(totals, scale)
    seen = (coincidences * apart).sum(axis=(1, 2))
    expected = (totals[:, :, None] * totals[:, None, :] * apart).sum(axis=(1, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1 - (count - 1) * seen / expected, dtype=np.float64)


def _distances(totals: FloatArray, scale: Scale) -> FloatArray:
    """Return the squared distances between categories (n, k, k) (Krippendorff 2011, section C)."""
    categories = totals.shape[1]
    if scale is Scale.NOMINAL:
        return np.broadcast_to(1.0 - np.eye(categories), (len(totals), categories, categories))
    below = np.cumsum(totals, axis=1) - totals / 2
    return np.asarray((below[:, :, None] - below[:, None, :]) ** 2, dtype=np.float64)


def pairwise_kappas(
    ratings: Sequence[Mapping[int, int]], categories: int
) -> dict[tuple[int, int], Kappa]:
    """Return Cohen's kappa of every two raters that have units in common, the lower id first.

    `ratings` has one entry a unit: category by rater.
    """
    pairs: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for unit in ratings:
        for first, second in combinations(sorted(unit), 2):
            pairs.setdefault((first, second), []).append((unit[first], unit[second]))
    return {both: cohens_kappa(common, categories) for both, common in pairs.items()}
