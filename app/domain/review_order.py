"""In which order a reviewer's time is best spent: samples that can be drawn again, doubts first.

A sample is drawn by a seed from all units of a run in their own order, so that the same seed and
run give the same sample on any machine and whatever was graded meanwhile. Doubt is one number, so
that a better measure can take the place of this one without touching the queues.
"""

from collections.abc import Sequence
from random import Random
from typing import TypeVar

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
    }
)


def shuffled(units: Sequence[Unit], seed: int, sample: int | None = None) -> list[Unit]:
    """Return units in a random order, only some of them where a sample size is given."""
    # A statistical sample that anybody can draw again needs no secrecy.
    order = list(units)
    Random(seed).shuffle(order)  # noqa: S311
    return order if sample is None else order[:sample]


def doubt(cost: float, maximum_cost: float, flags: Sequence[str]) -> float:
    """Return how doubtful a pose is: its share of the maximum matching cost, more for each flag."""
    share = cost / maximum_cost if maximum_cost > 0 else cost
    return share + sum(GRAVE_FLAG_DOUBT if flag in GRAVE_FLAGS else FLAG_DOUBT for flag in flags)
