"""Many covariances of three numbers at once, without a call for each matrix.

Here n symmetric matrices are one array (3, 3, n), entry by entry: each entry of all of them lies
together in memory, and their triangles (Cholesky's, without roots: L D L^T with a diagonal of ones)
are half a dozen operations on whole arrays. General solvers take a call a matrix, which for three
numbers is nearly all of their time.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from app.domain.arrays import FloatArray


class Factors(NamedTuple):
    """Triangles of n positive definite matrices, and the variances between them.

    `first` (2, n) is the unit triangle below its first one, `second` (n,) below the second;
    `variances` (3, n) are those left of each number when the ones before it are known.
    """

    first: FloatArray
    second: FloatArray
    variances: FloatArray


def factored(covariances: FloatArray) -> Factors:
    """Return the factors of positive definite matrices (3, 3, n)."""
    variances = np.empty(covariances.shape[1:])
    variances[0] = covariances[0, 0]
    first = covariances[1:, 0] / variances[0]
    left = covariances[1:, 1:] - first[:, None] * covariances[0, 1:]
    variances[1] = left[0, 0]
    second = left[1, 0] / left[0, 0]
    np.subtract(left[1, 1], second * left[1, 0], out=variances[2])
    return Factors(first, second, variances)


def apart(factors: Factors, vectors: FloatArray) -> FloatArray:
    """Return vectors (3, ..., n) as numbers that vary apart, by the factors' `variances`."""
    free = vectors.copy()
    first = factors.first if vectors.ndim == 2 else factors.first[:, None]
    free[1:] -= first * free[0]
    free[2] -= factors.second * free[1]
    return free


def together(factors: Factors, free: FloatArray) -> FloatArray:
    """Return vectors (3, n) of numbers that vary apart, by the triangle transposed.

    Of what `apart` gives, divided by the `variances`, this makes the product with the inverses of
    the matrices.
    """
    vectors = free.copy()
    vectors[1] -= factors.second * vectors[2]
    vectors[0] -= (factors.first * vectors[1:]).sum(axis=0)
    return vectors


def inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of one small positive definite matrix; NumPy's own takes ten times it."""
    from scipy.linalg.lapack import dposv  # noqa: PLC0415 - keeps the web process small

    _, inverse, failed = dposv(matrix, _unit(len(matrix)))
    return np.asarray(np.linalg.inv(matrix) if failed else inverse, dtype=np.float64)


@cache
def _unit(size: int) -> FloatArray:
    return np.eye(size)


def log_volume(factors: Factors) -> FloatArray:
    """Return the logarithms (n,) of the covariances' determinants."""
    one, two, three = factors.variances
    return np.asarray(np.log(one * two * three))


def carried(slopes: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return what slopes (3, k, n) make of a covariance (k, k) shared by all, or (k, k, n)."""
    if covariance.ndim == 2:
        by_unknown = covariance @ slopes
    else:
        by_unknown = np.einsum("ikn,mkn->imn", slopes, covariance)
    return np.asarray(np.einsum("ikn,jkn->ijn", slopes, by_unknown))
