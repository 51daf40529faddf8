"""Student's t: AIS errs more often by several sigmas than a normal distribution has it."""

from math import lgamma, log, pi

import numpy as np

from app.domain.arrays import FloatArray, IntArray
from app.domain.covariances import apart, factored, log_volume

FREEDOM = 6.0
_CONSTANT = np.array(
    [
        lgamma((FREEDOM + count) / 2) - lgamma(FREEDOM / 2) - count / 2 * log(FREEDOM * pi)
        for count in range(4)
    ]
)


def log_student(off: FloatArray, scale: FloatArray, count: IntArray) -> FloatArray:
    """Return the log densities (n,) of deviations (3, n) whose spread is `scale` (3, 3, n).

    `count` (n,) dimensions are counted; the others deviate by 0 and have a scale of 1.
    """
    factors = factored(scale)
    squares = (apart(factors, off) ** 2 / factors.variances).sum(axis=0)
    return np.asarray(
        _CONSTANT[count]
        - log_volume(factors) / 2
        - (FREEDOM + count) / 2 * np.log1p(squares / FREEDOM)
    )
