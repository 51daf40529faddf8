"""What others have published, to be printed beside our own figures with what they are shares of."""

from collections.abc import Mapping
from dataclasses import dataclass

from app.domain.matching_table import TOTAL, Result, RowName


@dataclass(frozen=True, slots=True)
class PublishedRow:
    """A line of the paper's table as printed."""

    count: int
    percent_of_visible: float
    percent_of_annotations: float | None = None


@dataclass(frozen=True, slots=True)
class RelatedSystem:
    """Another system's percentage, and what is known of the whole it is a part of."""

    name: str
    percent: float
    remark: str


PAPER_SOURCE = (
    "BONK-pose paper, table of association results: 581 vessels in a random sample of 500 images"
)
PAPER_VISIBLE, PAPER_ANNOTATIONS = 581, 434
PAPER_ROWS: Mapping[RowName, PublishedRow] = {
    RowName(Result.CORRECT, "good"): PublishedRow(375, 64.54, 86.41),
    RowName(Result.CORRECT, "ok"): PublishedRow(33, 5.68, 7.60),
    RowName(Result.CORRECT, "bad"): PublishedRow(2, 0.34, 0.46),
    RowName(Result.CORRECT, TOTAL): PublishedRow(410, 70.56, 94.47),
    RowName(Result.WRONG, "missing_ais"): PublishedRow(9, 1.55, 2.07),
    RowName(Result.WRONG, "false_positive"): PublishedRow(2, 0.34, 0.46),
    RowName(Result.WRONG, "cost_function"): PublishedRow(9, 1.55, 2.07),
    RowName(Result.WRONG, "subvessel"): PublishedRow(4, 0.69, 0.92),
    RowName(Result.WRONG, TOTAL): PublishedRow(24, 4.13, 5.52),
    RowName(Result.NO_MATCH, "not_detected"): PublishedRow(3, 0.52),
    RowName(Result.NO_MATCH, "no_ais"): PublishedRow(139, 23.92),
    RowName(Result.NO_MATCH, "neither"): PublishedRow(2, 0.34),
    RowName(Result.NO_MATCH, "cost_too_high"): PublishedRow(3, 0.52),
    RowName(Result.NO_MATCH, TOTAL): PublishedRow(147, 25.30),
}
_NOT_SAID = "the paper that cites it does not say of what; not comparable row by row."
RELATED: tuple[RelatedSystem, ...] = (
    RelatedSystem(
        "Lu et al. 2021",
        75.70,
        "Accuracy with dead reckoning; their association counts pairs of an AIS message and a "
        "vessel, so a vessel without AIS is in no denominator.",
    ),
    RelatedSystem("Huang et al. 2021", 74.3, f"Accuracy on average; {_NOT_SAID}"),
    RelatedSystem("Qu et al. 2022", 81.42, f"Overall accuracy; {_NOT_SAID}"),
    RelatedSystem("Gülsoylu et al. 2024", 74.76, f"Accuracy on average; {_NOT_SAID}"),
)
