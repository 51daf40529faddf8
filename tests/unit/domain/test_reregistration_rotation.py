"""One rotation among many wrong pairs, and the pointings that rotations make."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.arrays import FloatArray
from app.domain.reregistration_pointings import group_pointings
from app.domain.reregistration_rotation import fit_rotation, rotation_angle_deg
from app.domain.rotations import matrix_from_rotvec

TOLERANCE = 1e-3
Angle = st.floats(-0.1, 0.1)


def rays(count: int, seed: int) -> FloatArray:
    """Return unit rays (n, 3) into a field of view of 25 degrees."""
    at = np.random.default_rng(seed).uniform(-0.2, 0.2, (count, 2))
    ahead = np.column_stack([at, np.ones(count)])
    return np.asarray(ahead / np.linalg.norm(ahead, axis=1, keepdims=True))


@given(turn=st.tuples(Angle, Angle, Angle), seed=st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_a_rotation_is_found_among_wrong_pairs(turn: tuple[float, float, float], seed: int) -> None:
    """With nine pairs of ten wrong, the turn is found to a tenth of the noise's tolerance."""
    R = matrix_from_rotvec(turn)
    a, wrong = rays(300, seed), rays(300, seed + 1)
    noise = np.random.default_rng(seed + 2).normal(0, TOLERANCE / 10, (300, 3))
    b = np.where(np.arange(300)[:, None] < 40, a @ R.T + noise, wrong)
    fit = fit_rotation(a, b, np.ones(300), TOLERANCE, 0.5)
    assert fit is not None
    assert fit.inliers[:40].mean() > 0.9
    assert rotation_angle_deg(fit.R_b_from_a @ R.T) < np.degrees(TOLERANCE / 2)


def test_the_covariance_is_what_repetition_shows() -> None:
    """The stated uncertainty agrees with the scatter over seeds; the roll is the least certain."""
    misses, stated = [], []
    for seed in range(60):
        a = rays(60, seed)
        b = a + np.random.default_rng(seed + 500).normal(0, 1e-4, a.shape)
        b /= np.linalg.norm(b, axis=1, keepdims=True)
        fit = fit_rotation(a, b, np.ones(60), TOLERANCE, 0.5)
        assert fit is not None
        R = fit.R_b_from_a
        misses.append([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        stated.append(np.sqrt(np.diag(fit.covariance)))
    scatter = np.std(misses, axis=0) / 2
    assert np.mean(stated, axis=0) == pytest.approx(scatter, rel=0.35)
    assert scatter[2] > 3 * scatter[0]


def test_too_few_pairs_make_no_rotation() -> None:
    """No pair, one pair, and pairs that nowhere agree give nothing, not a guess."""
    none = np.empty((0, 3))
    assert fit_rotation(none, none, np.empty(0), TOLERANCE, 0.5) is None
    assert fit_rotation(rays(1, 1), rays(1, 2), np.ones(1), TOLERANCE, 0.5) is None
    assert fit_rotation(rays(2, 1), rays(2, 9), np.ones(2), TOLERANCE, 0.5) is None


def test_a_turn_beyond_the_largest_is_not_found() -> None:
    """A rotation further than asked for is no answer."""
    a = rays(50, 1)
    b = a @ matrix_from_rotvec([0.0, 0.3, 0.0]).T
    assert fit_rotation(a, b, np.ones(50), TOLERANCE, 0.2) is None
    assert fit_rotation(a, b, np.ones(50), TOLERANCE, 0.4) is not None


def test_images_are_grouped_into_pointings() -> None:
    """Rest, a move, and a way back make three pointings; small differences are averaged."""
    small = np.diag([1e-11, 1e-11, 1e-10])
    turns = [(0, 0, 0), (0.02, 0, 0), (0.3, 0, 0), (0.32, 0, 0), (0.31, 0, 0), (0, 0, 0.01)]
    rotations = [matrix_from_rotvec(np.radians(turn)) for turn in turns]
    pointings = group_pointings(rotations, [small] * 6, 0.05)
    assert [pointing.members for pointing in pointings] == [(0, 1), (2, 3, 4), (5,)]
    assert [pointing.angle_deg for pointing in pointings] == pytest.approx(
        [0.01, 0.31, 0.01], abs=1e-6
    )
    assert np.trace(pointings[1].covariance) < np.trace(pointings[2].covariance)


def test_an_uncertain_image_does_not_split_a_pointing() -> None:
    """An image in fog, known to 0.05 degree, may differ by more than the alarm; a sharp one not."""
    sharp, foggy = np.eye(3) * 1e-11, np.eye(3) * np.radians(0.05) ** 2
    rotations = [matrix_from_rotvec(np.radians([angle, 0, 0])) for angle in (0.0, 0.09, 0.0)]
    assert len(group_pointings(rotations, [sharp, foggy, sharp], 0.05)) == 1
    assert len(group_pointings(rotations, [sharp, sharp, sharp], 0.05)) == 3
