"""The matching table in REST and as CSV, the paper's own column beside ours."""

from collections.abc import Mapping

from pydantic import BaseModel, Field

from app.domain.matching_table import RESULT_LABELS, Result, Row
from app.evaluation.matching import MatchingFigures
from app.evaluation.published import (
    PAPER_ANNOTATIONS,
    PAPER_ROWS,
    PAPER_SOURCE,
    PAPER_VISIBLE,
    RELATED,
)
from app.evaluation.schemas import SampleOut, ShareOut

VISIBLE_MEANING = (
    "All vessels of the images marked complete: those with a pose of the pipeline that a person "
    "graded, and those that a person marked as missed. As in the paper, a false positive detection "
    "counts here although no vessel is under it."
)
ANNOTATIONS_MEANING = (
    "The graded poses of those images, right and wrong: what would stand in a dataset. Missed "
    "vessels have no pose and are not among them."
)
COUNTING = (
    (
        "Only images that a reviewer marked complete count, because only there every visible "
        "vessel is accounted for."
    ),
    (
        "A pose counts once, with the verdict that stands for it: the first opinion, or the one "
        "that settled a disagreement. Second opinions are counted nowhere here."
    ),
    (
        "A wrong match counts in the row of the first reason given with it; without one, under "
        "“Reason not given”. Its vessel is not to be marked as missed as well."
    ),
    "Poses that a person made by hand are not the pipeline's and are left out.",
    (
        "Percentages are rounded to two decimals and totals add up the printed ones, as the paper "
        "does; exact shares stand in the JSON."
    ),
)


class PaperRow(BaseModel):
    """What the paper prints in this row."""

    count: int
    percent_of_visible: float
    percent_of_annotations: float | None


class MatchingRow(BaseModel):
    """A row of the table; a group's last one is its total, with the reason `total`."""

    result: Result
    result_label: str
    reason: str
    label: str
    count: int
    percent_of_visible: float | None
    percent_of_annotations: float | None
    share_of_visible: float | None
    share_of_annotations: float | None
    paper: PaperRow | None = Field(description="Null where the paper has no such row")


class Denominator(BaseModel):
    """What percentages are shares of."""

    count: int
    paper_count: int
    meaning: str


class Denominators(BaseModel):
    """The two denominators of the table."""

    visible_vessels: Denominator
    annotations: Denominator


class RelatedOut(BaseModel):
    """Another system's published percentage."""

    name: str
    percent: float
    remark: str


class MatchingOut(BaseModel):
    """The paper's matching table from this installation's reviews."""

    images_complete: int
    images: int
    images_complete_by_run: Mapping[int, int]
    poses_ungraded: int = Field(description="Poses in complete images without a verdict, left out")
    sample: SampleOut | None
    denominators: Denominators
    rows: list[MatchingRow]
    correct_of_visible: ShareOut
    correct_of_annotations: ShareOut
    correct_without_false_positives: ShareOut
    counting: list[str]
    paper_source: str
    related: list[RelatedOut]


CSV_COLUMNS = (
    "result",
    "reason",
    "label",
    "count",
    "percent_of_visible",
    "percent_of_annotations",
    "paper_count",
    "paper_percent_of_visible",
    "paper_percent_of_annotations",
)


def matching_out(figures: MatchingFigures, sample: SampleOut | None) -> MatchingOut:
    """Write the table out."""
    table = figures.table
    return MatchingOut(
        images_complete=figures.complete,
        images=figures.images,
        images_complete_by_run=figures.complete_images,
        poses_ungraded=figures.ungraded,
        sample=sample,
        denominators=Denominators(
            visible_vessels=Denominator(
                count=table.visible, paper_count=PAPER_VISIBLE, meaning=VISIBLE_MEANING
            ),
            annotations=Denominator(
                count=table.annotations, paper_count=PAPER_ANNOTATIONS, meaning=ANNOTATIONS_MEANING
            ),
        ),
        rows=[_row(row) for row in table.rows],
        correct_of_visible=ShareOut.of(table.correct_of_visible),
        correct_of_annotations=ShareOut.of(table.correct_of_annotations),
        correct_without_false_positives=ShareOut.of(table.correct_of_real_vessels),
        counting=list(COUNTING),
        paper_source=PAPER_SOURCE,
        related=[
            RelatedOut(name=system.name, percent=system.percent, remark=system.remark)
            for system in RELATED
        ],
    )


def _row(row: Row) -> MatchingRow:
    paper = PAPER_ROWS.get(row.name)
    return MatchingRow(
        result=row.name.result,
        result_label=RESULT_LABELS[row.name.result],
        reason=row.name.reason,
        label=row.label,
        count=row.count,
        percent_of_visible=row.percent_of_visible,
        percent_of_annotations=row.percent_of_annotations,
        share_of_visible=row.share_of_visible,
        share_of_annotations=row.share_of_annotations,
        paper=paper
        and PaperRow(
            count=paper.count,
            percent_of_visible=paper.percent_of_visible,
            percent_of_annotations=paper.percent_of_annotations,
        ),
    )


def csv_rows(table: MatchingOut) -> list[dict[str, object]]:
    """Return the table's lines by column, closed by one for each denominator."""
    lines = [_line(row) for row in table.rows]
    for name, whole in (
        ("visible_vessels", table.denominators.visible_vessels),
        ("annotations", table.denominators.annotations),
    ):
        lines.append(
            {
                "result": "denominator",
                "reason": name,
                "label": whole.meaning,
                "count": whole.count,
                "paper_count": whole.paper_count,
            }
        )
    return lines


def _line(row: MatchingRow) -> dict[str, object]:
    paper = row.paper
    return {
        "result": row.result.value,
        "reason": row.reason,
        "label": row.label,
        "count": row.count,
        "percent_of_visible": row.percent_of_visible,
        "percent_of_annotations": row.percent_of_annotations,
        "paper_count": paper and paper.count,
        "paper_percent_of_visible": paper and paper.percent_of_visible,
        "paper_percent_of_annotations": paper and paper.percent_of_annotations,
    }
