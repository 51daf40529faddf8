"""How exact boxes are, learnt from evidence that is off by known amounts."""

from statistics import NormalDist

import numpy as np
import pytest

from app.domain.arrays import FloatArray
from app.domain.box_noise import USUAL_SHARE, Surprises, box_noise, scatter

SIZES_PX = np.tile([40.0, 120.0, 400.0], 20)
USUAL_PX2 = np.stack([np.full_like(SIZES_PX, 1.2), USUAL_SHARE * SIZES_PX]) ** 2


def off_by(sigma_px: FloatArray | float, others_px: float = 1.0) -> Surprises:
    """Return evidence whose errors have exactly this spread, at each size alike."""
    quantiles = np.repeat([NormalDist().inv_cdf((n + 0.5) / 20) for n in range(20)], 3)
    sigma = np.sqrt(np.asarray(sigma_px) ** 2 + others_px**2) * np.ones_like(SIZES_PX)
    others = np.full_like(SIZES_PX, others_px**2)
    return Surprises(quantiles * sigma, USUAL_PX2, others, np.ones_like(SIZES_PX))


def test_nothing_seen_is_what_is_usual() -> None:
    """Without evidence boxes are believed to be a little better than usual, errors may be worse."""
    learnt = box_noise([scatter(np.zeros(0, int), np.zeros(0), np.zeros((2, 0)))])
    for believed, expected in zip(learnt.believed, learnt.expected, strict=True):
        assert 0.4 < believed < 1 < expected < 4


@pytest.mark.parametrize("sigma_px", [0.6, 3.0, 0.03 * SIZES_PX])
def test_boxes_are_as_exact_as_they_look(sigma_px: FloatArray | float) -> None:
    """Sigmas of edges come out right within two thirds, by pixels or by share of the size."""
    learnt = np.sqrt(box_noise([off_by(sigma_px)]).believed.of(USUAL_PX2))
    ratio = learnt / sigma_px
    assert ((ratio > 0.6) & (ratio < 1.67)).all()


def test_a_wrong_size_is_no_noise() -> None:
    """A ship that is as much too narrow in each image leaves boxes exact."""
    vessel = np.repeat(np.arange(12), 5)
    wrong_m = np.repeat(np.linspace(-20, 20, 12), 5)
    told = scatter(vessel, wrong_m, USUAL_PX2)
    assert np.abs(told.off).max() == pytest.approx(0, abs=1e-9)
    assert np.sqrt(box_noise([told]).believed.of(USUAL_PX2)[0]) < 0.8
