"""Grades: what each says, which reasons may go with it, and the guideline reviewers follow.

The words are versioned and every review keeps the version it was made under, because a dataset's
figures mean nothing once the meaning of Good has drifted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

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


def wilson_interval(successes: int, total: int, z: float = 1.959964) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927), fractions of one; (0, 1) for none."""
    if total == 0:
        return 0.0, 1.0
    share = successes / total
    spread = z * sqrt(share * (1 - share) / total + z**2 / (4 * total**2))
    middle = share + z**2 / (2 * total)
    scale = 1 + z**2 / total
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)
