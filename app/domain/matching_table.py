"""The paper's table of association results: every visible vessel ends in exactly one row.

A vessel with a box is a correct match (Good, OK or Bad) or a wrong one with its reason; a vessel
without a box is no match, with the reason it was missed. So there are two denominators, and a
percentage means nothing without its own: all vessels ("of 100 vessels fed in"), and those with an
annotation ("of 100 boxes in the dataset"). A false positive detection has no vessel under it; the
paper counts it among the vessels all the same, and so does this table, which tells the share
without them apart.

Percentages are rounded to two decimals, and a group's total is the sum of its printed percentages,
as in the paper: its column adds up, and 410 of 581 read 70.56 although the share is 0.70568.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from enum import StrEnum
from typing import NamedTuple

from app.domain.sampling import Share

TOTAL = "total"
NOT_GIVEN = "not_given"
_HUNDREDTH = Decimal("0.01")


class Result(StrEnum):
    """What became of a vessel."""

    CORRECT = "correct"
    WRONG = "wrong"
    NO_MATCH = "no_match"


class RowName(NamedTuple):
    """A row's address: its group, and the grade or reason."""

    result: Result
    reason: str


RESULT_LABELS: Mapping[Result, str] = {
    Result.CORRECT: "Correct match",
    Result.WRONG: "Wrong match",
    Result.NO_MATCH: "No match",
}
LABELS: Mapping[RowName, str] = {
    RowName(Result.CORRECT, "good"): "Good 3D bounding box",
    RowName(Result.CORRECT, "ok"): "OK 3D bounding box",
    RowName(Result.CORRECT, "bad"): "Bad 3D bounding box",
    RowName(Result.WRONG, "missing_ais"): "Due to missing AIS data",
    RowName(Result.WRONG, "false_positive"): "Due to false positive detection",
    RowName(Result.WRONG, "cost_function"): "Due to cost function",
    RowName(Result.WRONG, "subvessel"): "Subvessel and combined unit confusion",
    RowName(Result.WRONG, "other"): "Other reason",
    RowName(Result.WRONG, NOT_GIVEN): "Reason not given",
    RowName(Result.NO_MATCH, "not_detected"): "Vessel not detected",
    RowName(Result.NO_MATCH, "no_ais"): "Vessel has no AIS",
    RowName(Result.NO_MATCH, "neither"): "Vessel has neither detection nor AIS",
    RowName(Result.NO_MATCH, "cost_too_high"): "Has detection and AIS, but cost was too high",
}
FALSE_POSITIVE = RowName(Result.WRONG, "false_positive")


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the table; percentages are None where a denominator is 0 or does not apply."""

    name: RowName
    label: str
    count: int
    percent_of_visible: float | None
    percent_of_annotations: float | None
    share_of_visible: float | None
    share_of_annotations: float | None

    @property
    def is_total(self) -> bool:
        """Whether this line sums up its group."""
        return self.name.reason == TOTAL


@dataclass(frozen=True, slots=True)
class MatchingTable:
    """The whole table: rows in the paper's order, each group closed by its total."""

    rows: tuple[Row, ...]
    visible: int
    annotations: int
    correct_of_visible: Share
    correct_of_annotations: Share
    correct_of_real_vessels: Share
    """Without false positive detections, where no vessel is."""


def matching_table(counts: Mapping[RowName, int]) -> MatchingTable:
    """Lay out counts as the paper does. Raises KeyError for a row that is not in the table."""
    unknown = counts.keys() - LABELS.keys()
    if unknown:
        raise KeyError(f"no such rows: {sorted(unknown)}")
    of_result = {
        result: sum(counts.get(name, 0) for name in LABELS if name.result is result)
        for result in Result
    }
    visible = sum(of_result.values())
    annotations = of_result[Result.CORRECT] + of_result[Result.WRONG]
    rows: list[Row] = []
    for result in Result:
        group = [
            _row(name, counts.get(name, 0), visible, annotations)
            for name in LABELS
            if name.result is result
        ]
        rows += [*group, _total(result, group, visible, annotations)]
    correct = of_result[Result.CORRECT]
    return MatchingTable(
        rows=tuple(rows),
        visible=visible,
        annotations=annotations,
        correct_of_visible=Share(correct, visible),
        correct_of_annotations=Share(correct, annotations),
        correct_of_real_vessels=Share(correct, visible - counts.get(FALSE_POSITIVE, 0)),
    )


def _row(name: RowName, count: int, visible: int, annotations: int) -> Row:
    of_annotations = annotations if name.result is not Result.NO_MATCH else 0
    return Row(
        name=name,
        label=LABELS[name],
        count=count,
        percent_of_visible=_percent(count, visible),
        percent_of_annotations=_percent(count, of_annotations),
        share_of_visible=Share(count, visible).value,
        share_of_annotations=Share(count, of_annotations).value,
    )


def _total(result: Result, group: list[Row], visible: int, annotations: int) -> Row:
    count = sum(row.count for row in group)
    of_annotations = annotations if result is not Result.NO_MATCH else 0
    return Row(
        name=RowName(result, TOTAL),
        label="Total",
        count=count,
        percent_of_visible=_sum([row.percent_of_visible for row in group]),
        percent_of_annotations=_sum([row.percent_of_annotations for row in group]),
        share_of_visible=Share(count, visible).value,
        share_of_annotations=Share(count, of_annotations).value,
    )


def _percent(count: int, total: int) -> float | None:
    if not total:
        return None
    exact = Decimal(100 * count) / Decimal(total)
    return float(exact.quantize(_HUNDREDTH, rounding=ROUND_HALF_UP))


def _sum(percents: list[float | None]) -> float | None:
    known = [percent for percent in percents if percent is not None]
    return round(sum(known), 2) if known else None
