"""What fitted chances are worth on images they were not fitted to.

Images an hour apart and more are different occasions. Each occasion is judged with chances fitted
to all others, from which the vessels it shows are left out: the same ferry on Monday and on Tuesday
would tell its own secret. Judged are the pairs that were made: how well their probabilities
foretell the verdicts (log loss), how many wrong ones remain and how many right ones would go. Pairs
that other chances would make anew are in nobody's verdicts, so nothing is said of them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, log

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.priors import CERTAINTY, GradedImage, GradedPair, Priors, fit_priors
from app.domain.sampling import wilson_interval

OCCASION_GAP_S = 3600.0
FEWEST_IMAGES = 30
FEWEST_OCCASIONS = 4
FEWEST_RIGHT = 40
_BOOTSTRAPS = 2000
_SURELY = 1e-6


@dataclass(frozen=True, slots=True)
class Missing:
    """How many more complete images, occasions and right matches are needed at least."""

    images: int
    occasions: int
    right: int

    @property
    def anything(self) -> bool:
        """Whether it is too early to fit."""
        return bool(self.images or self.occasions or self.right)


@dataclass(frozen=True, slots=True)
class Held:
    """Pairs judged on occasions that were left out: log loss a pair, wrong ones, right ones."""

    log_loss: float | None
    wrong: int
    right: int


@dataclass(frozen=True, slots=True)
class Gain:
    """Held-out figures with the chances that the graded runs took, and with fitted ones.

    `loss_change` is the change of the log loss a pair (negative is better) with its 95 % interval
    over occasions; None without pairs that say a probability.
    """

    now: Held
    fitted: Held
    loss_change: tuple[float, float, float] | None

    @property
    def is_better(self) -> bool:
        """Whether nothing got worse, and something better."""
        loss = 0.0 if self.loss_change is None else self.loss_change[0]
        errors = self.fitted.wrong - self.now.wrong + self.now.right - self.fitted.right
        return loss <= 0 and errors <= 0 and self.fitted.wrong <= self.now.wrong


@dataclass(frozen=True, slots=True)
class SilentShare:
    """The share of visible vessels without AIS, with its 95 % interval."""

    share: float
    low: float
    high: float
    of: int


def missing(images: Sequence[GradedImage]) -> Missing:
    """Tell what graded images are too few for."""
    right = sum(pair.right for image in images for pair in image.pairs)
    return Missing(
        max(0, FEWEST_IMAGES - len(images)),
        max(0, FEWEST_OCCASIONS - len(occasions(images))),
        max(0, FEWEST_RIGHT - right),
    )


def occasions(images: Sequence[GradedImage]) -> list[list[GradedImage]]:
    """Split images into occasions, in order of time."""
    ordered = sorted(images, key=lambda image: image.at_s)
    cuts = [
        index + 1
        for index, (one, two) in enumerate(pairwise(ordered))
        if two.at_s - one.at_s >= OCCASION_GAP_S
    ]
    return [ordered[a:b] for a, b in pairwise([0, *cuts, len(ordered)]) if b > a]


def silent_share(images: Sequence[GradedImage]) -> SilentShare:
    """Return how many of the visible vessels have no AIS."""
    silent = sum(image.silent for image in images)
    visible = sum(image.visible for image in images)
    low, high = wilson_interval(silent, visible) if visible else (0.0, 1.0)
    return SilentShare(silent / visible if visible else 0.0, low, high, visible)


def held_out_gain(images: Sequence[GradedImage]) -> Gain:
    """Judge fitted chances by occasions they were not fitted to."""
    parts = occasions(images)
    judged = []
    for number, part in enumerate(parts):
        seen = frozenset(
            [box.mmsi for image in part for box in image.boxes if box.mmsi is not None]
            + [pair.mmsi for image in part for pair in image.pairs]
        )
        others = [image for i, other in enumerate(parts) if i != number for image in other]
        fitted = fit_priors(others, without=seen)
        judged.append([_judged(image, pair, fitted) for image in part for pair in image.pairs])
    now, then = (_held([pair[which] for part in judged for pair in part]) for which in (0, 1))
    return Gain(now, then, _loss_change(judged))


@dataclass(frozen=True, slots=True)
class _Word:
    """What is said of a pair: whether it is made, and its log loss where it has a probability."""

    made: bool
    right: bool
    loss: float | None


def _judged(image: GradedImage, pair: GradedPair, fitted: Priors) -> tuple[_Word, _Word]:
    if pair.probability is None:
        limit = fitted.maximum_cost
        return (
            _Word(made=True, right=pair.right, loss=None),
            _Word(made=limit is None or pair.cost <= limit, right=pair.right, loss=None),
        )
    shift = fitted.log_odds(pair.score) - image.used.log_odds(pair.score)
    return _word(pair, pair.probability, 0.0), _word(pair, pair.probability, shift)


def _word(pair: GradedPair, probability: float, shift: float) -> _Word:
    """Return what a pair is worth once all pairs of its box are worth more or less."""
    odds = -pair.cost
    # The probability was own / (1 + own + those of other vessels).
    own = exp(min(CERTAINTY * odds, 300.0))
    others = max(0.0, own / max(probability, 1e-9) - 1 - own)
    factor = exp(CERTAINTY * shift)
    chance = own * factor / (1 + factor * (own + others))
    chance = min(max(chance, _SURELY), 1 - _SURELY)
    return _Word(odds + shift > 0, pair.right, -log(chance if pair.right else 1 - chance))


def _held(words: Sequence[_Word]) -> Held:
    losses = [word.loss for word in words if word.loss is not None]
    return Held(
        float(np.mean(losses)) if losses else None,
        sum(word.made and not word.right for word in words),
        sum(word.made and word.right for word in words),
    )


def _loss_change(
    judged: Sequence[Sequence[tuple[_Word, _Word]]],
) -> tuple[float, float, float] | None:
    """Return the change of log loss a pair with its interval: whole occasions drawn anew."""
    sums: FloatArray = np.array([[sum(part), len(part)] for part in map(list, _changes(judged))])
    if not sums[:, 1].sum():
        return None
    draws = np.random.default_rng(0).integers(len(sums), size=(_BOOTSTRAPS, len(sums)))
    drawn = sums[draws].sum(axis=1)
    means = drawn[:, 0] / np.maximum(drawn[:, 1], 1)
    low, high = np.percentile(means, [2.5, 97.5])
    total, count = sums.sum(axis=0)
    return float(total / count), float(low), float(high)


def _changes(judged: Sequence[Sequence[tuple[_Word, _Word]]]) -> Iterator[list[float]]:
    for part in judged:
        yield [
            then.loss - now.loss
            for now, then in part
            if now.loss is not None and then.loss is not None
        ]
