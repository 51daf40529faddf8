"""Many covariances of three numbers at once, without a call for each matrix.

Here n symmetric matrices are one array (3, 3, n), entry by entry: each entry of all of them lies
together in memory, and Cholesky's triangle of all is a dozen operations on whole arrays. General
solvers take a call a matrix, which for three numbers is nearly all of their time.
"""

import numpy as np

from app.domain.arrays import FloatArray


def lower_factor(covariances: FloatArray) -> FloatArray:
    """Return the lower triangles (3, 3, n) whose squares are positive definite (3, 3, n)."""
    lower = np.zeros_like(covariances)
    lower[0, 0] = np.sqrt(covariances[0, 0])
    lower[1:, 0] = covariances[1:, 0] / lower[0, 0]
    lower[1, 1] = np.sqrt(covariances[1, 1] - lower[1, 0] ** 2)
    lower[2, 1] = (covariances[2, 1] - lower[2, 0] * lower[1, 0]) / lower[1, 1]
    lower[2, 2] = np.sqrt(covariances[2, 2] - lower[2, 0] ** 2 - lower[2, 1] ** 2)
    return lower


def whitened(lower: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (3, ..., n) in units in which their covariances are 1: the triangle undone."""
    white = np.empty_like(vectors)
    white[0] = vectors[0] / lower[0, 0]
    white[1] = (vectors[1] - lower[1, 0] * white[0]) / lower[1, 1]
    white[2] = (vectors[2] - lower[2, 0] * white[0] - lower[2, 1] * white[1]) / lower[2, 2]
    return white


def unwhitened(lower: FloatArray, white: FloatArray) -> FloatArray:
    """Return vectors (3, ..., n) that the triangle, transposed, turns into `white`.

    After `whitened` this is the product with the inverse of the squares of `lower`.
    """
    vectors = np.empty_like(white)
    vectors[2] = white[2] / lower[2, 2]
    vectors[1] = (white[1] - lower[2, 1] * vectors[2]) / lower[1, 1]
    vectors[0] = (white[0] - lower[1, 0] * vectors[1] - lower[2, 0] * vectors[2]) / lower[0, 0]
    return vectors


def log_volume(lower: FloatArray) -> FloatArray:
    """Return the logarithms (n,) of the covariances' determinants."""
    return np.asarray(2 * np.log(lower[0, 0] * lower[1, 1] * lower[2, 2]))


def carried(slopes: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return what slopes (3, k, n) make of a covariance (k, k) shared by all, or (k, k, n)."""
    if covariance.ndim == 2:
        by_unknown = covariance @ slopes
    else:
        by_unknown = np.einsum("ikn,mkn->imn", slopes, covariance)
    return np.asarray(np.einsum("ikn,jkn->ijn", slopes, by_unknown))
