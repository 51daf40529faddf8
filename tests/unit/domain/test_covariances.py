"""Covariances of many at once are those that a general solver finds one by one."""

import numpy as np

from app.domain.covariances import apart, carried, factored, log_volume, together


def test_many_at_once_are_what_each_is_alone() -> None:
    """Varying apart and back, volumes and carried covariances agree with numpy's solvers."""
    rng = np.random.default_rng(5)
    roots = rng.normal(size=(40, 3, 3))
    each = roots @ np.swapaxes(roots, 1, 2) + np.eye(3)
    vectors, slopes = rng.normal(size=(40, 3)), rng.normal(size=(40, 3, 4))
    shared = np.diag([1.0, 4.0, 9.0, 0.5]) + 0.1
    factors = factored(np.moveaxis(each, 0, -1))
    free = apart(factors, vectors.T)
    several = apart(factors, np.stack([vectors.T, vectors.T], axis=1))
    solved = np.linalg.solve(each, vectors[..., None])[..., 0]
    weighed = free / factors.variances
    np.testing.assert_array_equal(several, np.stack([free, free], axis=1))
    np.testing.assert_allclose(together(factors, weighed).T, solved, rtol=1e-10)
    np.testing.assert_allclose((free * weighed).sum(0), (vectors * solved).sum(1), rtol=1e-10)
    np.testing.assert_allclose(log_volume(factors), np.log(np.linalg.det(each)), rtol=1e-10)
    expected = slopes @ shared @ np.swapaxes(slopes, 1, 2)
    np.testing.assert_allclose(
        np.moveaxis(carried(np.moveaxis(slopes, 0, -1), shared), -1, 0), expected, rtol=1e-10
    )
