"""Agreement between reviewers against published worked examples."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.agreement import (
    Scale,
    alpha_interval,
    cohens_kappa,
    krippendorffs_alpha,
    pairwise_kappas,
    percent_agreement,
)

# Krippendorff (2011), "Computing Krippendorff's Alpha-Reliability", section C: four observers,
# twelve units, not everybody saw everything.
FOUR_OBSERVERS = (
    (1, 2, 3, 3, 2, 1, 4, 1, 2, None, None, None),
    (1, 2, 3, 3, 2, 2, 4, 1, 2, 5, None, 3),
    (None, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, None),
    (1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, None),
)
UNITS = [
    [value - 1 for value in unit if value is not None] for unit in zip(*FOUR_OBSERVERS, strict=True)
]


def test_alpha_of_four_observers_is_krippendorffs() -> None:
    """Nominal alpha is .743 and ordinal alpha .815, as printed there."""
    assert krippendorffs_alpha(UNITS, 5, Scale.NOMINAL) == pytest.approx(0.743, abs=5e-4)
    assert krippendorffs_alpha(UNITS, 5, Scale.ORDINAL) == pytest.approx(0.815, abs=5e-4)


def test_alpha_of_two_observers_is_krippendorffs() -> None:
    """Two observers and two categories give .095, five categories .692, as printed there."""
    ben = (0, 1, 0, 0, 0, 0, 0, 0, 1, 0)
    gerry = (1, 1, 1, 0, 0, 1, 0, 0, 0, 0)
    binary = [list(pair) for pair in zip(ben, gerry, strict=True)]
    assert krippendorffs_alpha(binary, 2, Scale.NOMINAL) == pytest.approx(0.095, abs=5e-4)
    letters = zip("aabbdcccedda", "babbbccceddd", strict=True)
    coded = [["abcde".index(value) for value in pair] for pair in letters]
    assert krippendorffs_alpha(coded, 5, Scale.NOMINAL) == pytest.approx(0.692, abs=5e-4)


def test_kappa_of_a_clinic_is_fleisss() -> None:
    """Fleiss (1981, p. 213 and 221): 100 subjects, three diagnoses, kappa .676 with s.e. .088."""
    table = ((75, 1, 4), (5, 4, 1), (0, 0, 10))
    pairs = [
        (row, column) for row in range(3) for column in range(3) for _ in range(table[row][column])
    ]
    found = cohens_kappa(pairs, 3)
    assert (found.units, found.agreed) == (100, 89)
    assert found.kappa == pytest.approx(0.676, abs=5e-4)
    assert found.interval is not None
    assert (found.interval[1] - found.interval[0]) / 2 / 1.96 == pytest.approx(0.088, abs=1e-3)


def test_equal_percentages_may_hide_unequal_kappas() -> None:
    """Two tables with 60 % agreement: kappa .1304 and .2593, the textbook pair."""
    first = cohens_kappa([(0, 0)] * 45 + [(0, 1)] * 15 + [(1, 0)] * 25 + [(1, 1)] * 15, 2)
    second = cohens_kappa([(0, 0)] * 25 + [(0, 1)] * 35 + [(1, 0)] * 5 + [(1, 1)] * 35, 2)
    assert first.kappa == pytest.approx(0.1304, abs=5e-5)
    assert second.kappa == pytest.approx(0.2593, abs=5e-5)


def test_what_cannot_be_told_is_not_told() -> None:
    """Without common units, or with one grade only, there is no figure rather than a wrong one."""
    assert cohens_kappa([], 4).kappa is None
    assert cohens_kappa([(0, 0)] * 9, 4).kappa is None
    assert cohens_kappa([(0, 0), (1, 1)], 4).interval is None
    assert krippendorffs_alpha([[0], [1]], 4, Scale.NOMINAL) is None
    assert krippendorffs_alpha([[0, 0], [0, 0]], 4, Scale.ORDINAL) is None
    assert alpha_interval([[0, 1]], 4, Scale.NOMINAL) is None
    assert percent_agreement([[0], []]) is None


def test_the_interval_of_alpha_holds_alpha_and_repeats_itself() -> None:
    """Drawing units again with the same seed gives the same interval, and alpha lies in it."""
    low, high = alpha_interval(UNITS, 5, Scale.ORDINAL) or (1.0, -1.0)
    assert low < 0.815 < high
    assert alpha_interval(UNITS, 5, Scale.ORDINAL) == (low, high)


def test_raters_are_compared_where_they_met() -> None:
    """Each two raters are compared on the units that both have rated, and on no other."""
    units = [{7: 0, 3: 0}, {7: 1, 3: 2}, {7: 1, 9: 1}, {3: 0}]
    found = pairwise_kappas(units, 4)
    assert set(found) == {(3, 7), (7, 9)}
    assert (found[3, 7].units, found[3, 7].agreed) == (2, 1)


RATINGS = st.lists(st.lists(st.integers(0, 3), min_size=2, max_size=4), min_size=2, max_size=30)


@given(RATINGS)
def test_full_agreement_is_one(ratings: list[list[int]]) -> None:
    """Where all raters of each unit agree, percent and both alphas are one, or undefined."""
    unanimous = [[unit[0]] * len(unit) for unit in ratings]
    assert percent_agreement(unanimous) == 1
    for scale in Scale:
        alpha = krippendorffs_alpha(unanimous, 4, scale)
        assert alpha is None or alpha == pytest.approx(1.0)


@given(RATINGS)
def test_agreement_never_exceeds_one(ratings: list[list[int]]) -> None:
    """No scale gives more than full agreement, and the order of raters does not matter."""
    for scale in Scale:
        alpha = krippendorffs_alpha(ratings, 4, scale)
        assert alpha is None or alpha <= 1 + 1e-12
        turned = krippendorffs_alpha([unit[::-1] for unit in ratings], 4, scale)
        assert (alpha is None) == (turned is None)
        assert alpha is None or turned == pytest.approx(alpha)
