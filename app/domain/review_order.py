"""In which order a reviewer's time is best spent: samples that can be drawn again, doubts first.

A sample is drawn by a seed from all units of a run in their own order, so that the same seed and
run give the same sample on any machine and whatever was graded meanwhile. Doubt is one number:
how improbable the match is, and how far the box may be off in place, heading and height by its own
word. Where an estimator gives no such word the share of the matching cost stands for it.
"""

from collections.abc import Sequence
from math import hypot, sqrt
from random import Random
from typing import NamedTuple, TypeVar

Unit = TypeVar("Unit")
# What a flag adds, in units of the matching cost's maximum: each says that a pull was missing, or
# that AIS is to be doubted.
FLAG_DOUBT = 0.25
GRAVE_FLAG_DOUBT = 1.0
GRAVE_FLAGS = frozenset(
    {
        "no_height",
        "no_length",
        "no_width",
        "cut_bottom",
        "jump",
        "two_places",
        "impossible_speed",
        "clock_suspect",
        "unsure_place",
        "contradicts_ais",
    }
)


class Certainty(NamedTuple):
    """One sigma of a pose's place along its worst direction, heading and height.

    `probability` is that of its match; None where the matching gives none.
    """

    place_m: float
    heading_deg: float
    height_m: float
    probability: float | None


def worst_sigma_m(covariance_in_enu_m2: Sequence[Sequence[float]]) -> float:
    """Return one sigma along the water in the direction where a place is least known."""
    (east, both, _), (_, north, _), _ = covariance_in_enu_m2
    return sqrt((east + north) / 2 + hypot((east - north) / 2, both))


# An error of each of these makes a pose about as bad as a wrong match.
_BAD = Certainty(place_m=20.0, heading_deg=15.0, height_m=10.0, probability=None)


def shuffled(units: Sequence[Unit], seed: int, sample: int | None = None) -> list[Unit]:
    """Return units in a random order, only some of them where a sample size is given."""
    # A statistical sample that anybody can draw again needs no secrecy.
    order = list(units)
    Random(seed).shuffle(order)  # noqa: S311
    return order if sample is None else order[:sample]


def doubt(
    cost: float, maximum_cost: float, flags: Sequence[str], certainty: Certainty | None = None
) -> float:
    """Return how doubtful a pose is, more for each flag.

    By its own word where it gives one, else by its share of the maximum matching cost.
    """
    share = cost / maximum_cost if maximum_cost > 0 else cost
    if certainty is not None:
        unlikely = share if certainty.probability is None else 1 - certainty.probability
        share = (
            unlikely
            + certainty.place_m / _BAD.place_m
            + certainty.heading_deg / _BAD.heading_deg
            + certainty.height_m / _BAD.height_m
        )
    return share + sum(GRAVE_FLAG_DOUBT if flag in GRAVE_FLAGS else FLAG_DOUBT for flag in flags)
