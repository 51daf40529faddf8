"""Student's t: AIS errs more often by several sigmas than a normal distribution has it."""

from math import lgamma, log, pi

import numpy as np

from app.domain.arrays import FloatArray, IntArray

FREEDOM = 6.0
_CONSTANT = np.array(
    [
        lgamma((FREEDOM + count) / 2) - lgamma(FREEDOM / 2) - count / 2 * log(FREEDOM * pi)
        for count in range(4)
    ]
)


def log_student(off: FloatArray, scale: FloatArray, count: IntArray | int) -> FloatArray:
    """Return the log densities of deviations (n, 3) whose spread is `scale` (n, 3, 3).

    `count` dimensions are counted; the others deviate by 0 and have a scale of 1.
    """
    squares = (off * np.linalg.solve(scale, off[..., None])[..., 0]).sum(axis=1)
    volume = np.log(np.linalg.det(scale))
    return np.asarray(
        _CONSTANT[count] - volume / 2 - (FREEDOM + count) / 2 * np.log1p(squares / FREEDOM)
    )
