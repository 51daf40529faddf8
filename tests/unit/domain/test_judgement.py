"""Grades by a simulator's truth: the guideline's words in numbers."""

import numpy as np
import pytest

from app.domain.grading import check_reasons
from app.domain.judgement import LIMITS, BoxErrors, foot_offset, judge_box, judge_mismatch


def errors(
    position: float = 0.0, heading_deg: float = 0.0, height: float = 0.0, length: float = 0.0
) -> BoxErrors:
    """Return errors of which all but the named are nothing."""
    return BoxErrors(position, heading_deg, height, length)


def test_a_heading_error_over_ten_degrees_is_not_good() -> None:
    """Nine degrees may be Good, eleven are not: the one limit the paper gives."""
    assert judge_box(errors(heading_deg=9)).grade == "good"
    turned = judge_box(errors(heading_deg=11))
    assert (turned.grade, turned.reasons) == ("ok", ("heading",))


def test_the_worst_error_decides_and_gives_the_reason() -> None:
    """A box that is a little turned and far too high is Bad for its height alone."""
    judged = judge_box(errors(heading_deg=14, height=0.9))
    assert (judged.grade, judged.reasons) == ("bad", ("height",))
    assert "+90%" in judged.note


def test_too_low_is_as_bad_as_too_high() -> None:
    """Signs say which way it is off, not how bad it is."""
    assert judge_box(errors(height=-0.7)).grade == judge_box(errors(height=0.7)).grade == "bad"


@pytest.mark.parametrize("name", sorted(LIMITS))
def test_cases_near_a_limit_are_unclear(name: str) -> None:
    """A fifth to either side of a limit is no clear case, well away from it is."""
    field = {"heading": "heading_deg", "size": "length"}.get(name, name)
    limits = LIMITS[name]
    for limit in (limits.good, limits.ok):
        for factor, clear in ((0.9, False), (1.1, False), (0.7, True), (1.3, True)):
            judged = judge_box(errors(**{field: limit * factor}))
            assert judged.clear is clear, (limit, factor)


def test_mismatches_are_wrong_with_the_reason_of_the_table() -> None:
    """No vessel, one without AIS, and another one give the three reasons a truth can tell."""
    nothing = judge_mismatch(None, seen_has_ais=False, said="ANNEGRET")
    silent = judge_mismatch("barge", seen_has_ais=False, said="ANNEGRET")
    another = judge_mismatch("tug", seen_has_ais=True, said="ANNEGRET")
    assert [judged.reasons for judged in (nothing, silent, another)] == [
        ("false_positive",),
        ("missing_ais",),
        ("cost_function",),
    ]
    for judged in (nothing, silent, another):
        assert judged.grade == "wrong"
        check_reasons(judged.grade, judged.reasons)


def test_the_foot_is_measured_in_the_image() -> None:
    """Moved by 10 px, a vessel 100 px wide is off by a tenth of its extent."""
    foot = np.array([[0.0, 0], [50, 0], [50, 10], [0, 10]])
    assert foot_offset(foot + np.array([6.0, 8.0]), foot, (0, 0, 100, 40)) == pytest.approx(0.1)
