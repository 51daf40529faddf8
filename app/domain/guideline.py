"""The guideline as reviewers read it: grades, reasons, and how to treat hard cases, by version.

A version is never reworded once reviews were made under it: a new wording is a new version, so that
a figure can say by which words its poses were judged.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from app.domain.grading import GUIDELINE, GUIDELINE_VERSION, GradeRule


@dataclass(frozen=True, slots=True)
class ReasonRule:
    """A reason: its code, its name on screen, and when it applies."""

    code: str
    name: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Guideline:
    """All that a reviewer has to know, in one version."""

    version: int
    grades: tuple[GradeRule, ...]
    shape_reasons: tuple[ReasonRule, ...]
    match_reasons: tuple[ReasonRule, ...]
    missed_reasons: tuple[ReasonRule, ...]
    hard_cases: tuple[str, ...]


_OTHER = ReasonRule("other", "Other", "Something else; a comment says what.")
_FIRST = Guideline(
    version=1,
    grades=GUIDELINE,
    shape_reasons=(
        ReasonRule("position", "Position", "The box stands beside, before or behind the hull."),
        ReasonRule("heading", "Heading", "The box is turned against the hull."),
        ReasonRule("height", "Height", "The top is too high (a mast, clutter) or too low."),
        ReasonRule("size", "Size", "Length or width are not the hull's."),
        _OTHER,
    ),
    match_reasons=(
        ReasonRule(
            "missing_ais",
            "Missing AIS",
            "The visible vessel sends no AIS data; the box took another vessel's.",
        ),
        ReasonRule("false_positive", "False positive", "The detection shows no vessel."),
        ReasonRule(
            "cost_function",
            "Cost function",
            "AIS data of the visible vessel was there, yet another vessel's was chosen.",
        ),
        ReasonRule(
            "subvessel",
            "Subvessel",
            "A unit of several vessels: the whole was taken for a part, or one part for another.",
        ),
        _OTHER,
    ),
    missed_reasons=(
        ReasonRule("not_detected", "Not detected", "AIS data is there, a detection is not."),
        ReasonRule("no_ais", "No AIS", "A detection is there, AIS data is not."),
        ReasonRule("neither", "Neither", "Neither a detection nor AIS data."),
        ReasonRule(
            "cost_too_high", "Cost too high", "Both are there, but they were not put together."
        ),
    ),
    hard_cases=(
        (
            "Judge what you see, not the overlap: a box turned by 10 degrees can cover the vessel "
            "well and is not Good."
        ),
        (
            "Antennas and thin masts that stand out of the box do not spoil Good; a box that grew "
            "to hold them has the wrong height."
        ),
        "A vessel cut by the image's border is judged by the part that is visible.",
        "In doubt between two grades take the worse one, and say why.",
        (
            "Mark as missed only vessels without any box. The vessel under a wrong box is counted "
            "there already."
        ),
        (
            "An image is complete when every visible vessel has a graded box or is marked as "
            "missed. Vessels too small to tell their length are not counted as visible."
        ),
    ),
)
GUIDELINES: Mapping[int, Guideline] = MappingProxyType({_FIRST.version: _FIRST})


def current_guideline() -> Guideline:
    """Return the guideline that new reviews are made under."""
    return GUIDELINES[GUIDELINE_VERSION]
