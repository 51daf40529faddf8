"""Shares from samples against published values."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.sampling import needed_total, wilson_half_width, wilson_interval


@pytest.mark.parametrize(
    ("successes", "total", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_interval_agrees_with_newcombe(
    successes: int, total: int, low: float, high: float
) -> None:
    """The intervals are those Newcombe (1998, table I, method 3) prints."""
    assert wilson_interval(successes, total) == pytest.approx((low, high), abs=5e-5)


def test_nothing_seen_says_nothing() -> None:
    """Without a single unit the share may be anything."""
    assert wilson_interval(0, 0) == (0.0, 1.0)


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_holds_the_share_and_stays_within_one(counts: tuple[int, int]) -> None:
    """The seen share lies in its interval, and the interval lies between none and all."""
    successes, total = counts
    low, high = wilson_interval(successes, total)
    assert 0 <= low <= successes / total + 1e-12
    assert successes / total - 1e-12 <= high <= 1


@given(st.floats(0, 1), st.floats(0.005, 0.3))
def test_the_needed_number_is_the_smallest_that_is_enough(share: float, wanted: float) -> None:
    """With the needed number the interval is narrow enough; with one less it is not."""
    needed = needed_total(share, wanted)
    assert wilson_half_width(share, needed) <= wanted
    assert needed == 1 or wilson_half_width(share, needed - 1) > wanted


def test_a_small_population_needs_fewer() -> None:
    """Half of them, five points wide: 381 of very many, 277 of a thousand, never more than all."""
    assert needed_total(0.5, 0.05) == 381
    assert needed_total(0.5, 0.05, population=1000) == 277
    assert needed_total(0.5, 0.01, population=40) == 40
    assert needed_total(0.5, 0.05, population=0) == 0


@pytest.mark.parametrize("wanted", [0.0, -0.1, 0.5, 1.0])
def test_a_senseless_width_is_refused(wanted: float) -> None:
    """A width of nothing, or of everything, is no question."""
    with pytest.raises(ValueError, match="half-width"):
        needed_total(0.5, wanted)
