"""The matching table from the paper's own counts, and from any."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.matching_table import LABELS, Result, RowName, matching_table
from app.evaluation.published import PAPER_ANNOTATIONS, PAPER_ROWS, PAPER_VISIBLE

PAPER_COUNTS = {name: row.count for name, row in PAPER_ROWS.items() if name in LABELS}


def test_the_papers_counts_give_the_papers_table() -> None:
    """Every count and percentage the paper prints comes out, totals and denominators too."""
    table = matching_table(PAPER_COUNTS)
    assert (table.visible, table.annotations) == (PAPER_VISIBLE, PAPER_ANNOTATIONS)
    printed = {row.name: row for row in table.rows}
    for name, paper in PAPER_ROWS.items():
        row = printed[name]
        assert (row.count, row.percent_of_visible, row.percent_of_annotations) == (
            paper.count,
            paper.percent_of_visible,
            paper.percent_of_annotations,
        ), name


def test_the_headline_shares_are_exact_and_carry_an_interval() -> None:
    """410 of 581, 410 of 434, and 410 of the 579 that are vessels, with Wilson's intervals."""
    table = matching_table(PAPER_COUNTS)
    assert table.correct_of_visible.value == pytest.approx(410 / 581)
    assert table.correct_of_visible.interval == pytest.approx((0.6674, 0.7412), abs=5e-4)
    assert table.correct_of_annotations.value == pytest.approx(410 / 434)
    assert table.correct_of_real_vessels.value == pytest.approx(410 / 579)


def test_nothing_reviewed_gives_no_percentage() -> None:
    """Without a vessel every row is there, counts nothing and claims nothing."""
    table = matching_table({})
    assert len(table.rows) == len(LABELS) + len(Result)
    assert {row.percent_of_visible for row in table.rows} == {None}
    assert table.correct_of_visible.value is None


def test_a_row_that_is_none_is_refused() -> None:
    """A reason that no row stands for is not dropped in silence."""
    with pytest.raises(KeyError, match="asleep"):
        matching_table({RowName(Result.WRONG, "asleep"): 1})


@given(st.dictionaries(st.sampled_from(sorted(LABELS)), st.integers(0, 1000)))
def test_every_vessel_is_in_one_row(counts: Mapping[RowName, int]) -> None:
    """Totals are sums of their rows, and the groups together are all visible vessels."""
    table = matching_table(counts)
    single = [row for row in table.rows if not row.is_total]
    totals = {row.name.result: row for row in table.rows if row.is_total}
    assert table.visible == sum(counts.values()) == sum(row.count for row in single)
    for result, total in totals.items():
        group = [row for row in single if row.name.result is result]
        assert total.count == sum(row.count for row in group)
        if table.visible:
            percents = [row.percent_of_visible or 0 for row in group]
            assert total.percent_of_visible == pytest.approx(sum(percents))
    assert table.annotations == table.visible - totals[Result.NO_MATCH].count
