"""Shares estimated from samples: how sure one may be, and how much more looking would help.

A share of graded poses is an estimate of the share among all of them. Wilson's interval (1927) says
how far it may be off and, unlike the textbook p plus or minus, stays sensible near 0 and 1, where
good pipelines live. Turned around it says how many grades a wanted precision needs.
"""

from dataclasses import dataclass
from math import ceil, sqrt

Z_95 = 1.959964


def wilson_interval(successes: int, total: int, z: float = Z_95) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927), fractions of one; (0, 1) for none."""
    if total == 0:
        return 0.0, 1.0
    share = successes / total
    middle = (share + z**2 / (2 * total)) / (1 + z**2 / total)
    reach = wilson_half_width(share, total, z)
    return max(0.0, middle - reach), min(1.0, middle + reach)


def wilson_half_width(share: float, total: float, z: float = Z_95) -> float:
    """Return half the width of Wilson's interval for a share seen in so many units."""
    inner = share * (1 - share) / total + z**2 / (4 * total**2)
    return z * sqrt(inner) / (1 + z**2 / total)


@dataclass(frozen=True, slots=True)
class Share:
    """A part of a whole with its 95 % interval (Wilson); fractions of one, None of nothing."""

    count: int
    total: int

    @property
    def value(self) -> float | None:
        """The share itself."""
        return self.count / self.total if self.total else None

    @property
    def interval(self) -> tuple[float, float]:
        """Where the share among all such units lies, if they are independent of each other."""
        return wilson_interval(self.count, self.total)


def needed_total(
    share: float, half_width: float, population: int | None = None, z: float = Z_95
) -> int:
    """Return how many units must be seen until Wilson's interval is as narrow as wanted.

    `share` is what is expected, 0.5 being the worst; `half_width` is a fraction of one. From a
    finite population drawn without replacement fewer are enough: n / (1 + (n - 1) / N) (Cochran
    1977, eq. 4.2). Raises ValueError for a width that is not between 0 and 0.5.
    """
    if not 0 < half_width < 0.5:
        raise ValueError("the half-width must lie between 0 and 0.5")
    least, most = 0, 1
    while wilson_half_width(share, most, z) > half_width:
        least, most = most, most * 2
    while most - least > 1:
        middle = (least + most) // 2
        if wilson_half_width(share, middle, z) > half_width:
            least = middle
        else:
            most = middle
    if population is None:
        return most
    return min(population, ceil(most / (1 + (most - 1) / population))) if population else 0
