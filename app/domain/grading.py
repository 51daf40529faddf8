"""Grades: what each says, which reasons may go with it, and the guideline reviewers follow.

The words are versioned and every review keeps the version it was made under, because a dataset's
figures mean nothing once the meaning of Good has drifted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

GUIDELINE_VERSION = 1
SHAPE_REASONS = ("position", "heading", "height", "size", "other")
MATCH_REASONS = ("missing_ais", "false_positive", "cost_function", "subvessel", "other")


@dataclass(frozen=True, slots=True)
class GradeRule:
    """One grade: its code, its name on screen, what it says, and its reason codes."""

    code: str
    name: str
    meaning: str
    reasons: tuple[str, ...]


GUIDELINE: tuple[GradeRule, ...] = (
    GradeRule(
        "good",
        "Good",
        "The box precisely aligns with the visible vessel, in position and orientation. Missing "
        "antennas alone do not spoil it; a heading error of about 10 degrees does.",
        (),
    ),
    GradeRule(
        "ok",
        "OK",
        "The box mostly fits, with a slight inaccuracy: off-centre, or a skewed heading.",
        SHAPE_REASONS,
    ),
    GradeRule(
        "bad",
        "Bad",
        "The right vessel, but a significant deviation: far off, or a mast or clutter in the "
        "height.",
        SHAPE_REASONS,
    ),
    GradeRule(
        "wrong",
        "Wrong match",
        "The AIS data is another vessel's, or there is no vessel at all.",
        MATCH_REASONS,
    ),
)
_RULES = {rule.code: rule for rule in GUIDELINE}


def check_reasons(grade: str, reasons: Sequence[str]) -> None:
    """Raise ValueError naming the first reason that does not go with a grade."""
    allowed = _RULES[grade].reasons
    for reason in reasons:
        if reason not in allowed:
            options = ", ".join(allowed) or "none"
            raise ValueError(f"{reason!r} does not go with {grade}; there are: {options}")
