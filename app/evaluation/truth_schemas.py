"""Poses against truth, and projected boxes against human ones, in REST and as CSV."""

from collections.abc import Sequence

from pydantic import BaseModel, Field

from app.domain.pose_errors import Calibration, ErrorSummary
from app.evaluation.iou import IouFigures
from app.evaluation.poses import KINDS, PoseFigures, PoseTable
from app.evaluation.schemas import Interval, ShareOut
from app.evaluation.service import Correct
from app.tables.reviews import Grade

IOU_SOURCE = "BONK-pose paper, figure of IoU by grade: 245 pairs of a human box and a projected box"
PAPER_PAIRS = 245
POSE_COUNTING = (
    (
        "Truth is known where a site is simulated. A pose is a correct match when the vessel that "
        "its detection covers best is the one that AIS said; errors are those of correct matches."
    ),
    (
        "The match rate is of vessels with AIS that are at least half visible, in images that a "
        "run has done."
    ),
    (
        "ADD-S is the mean distance from each true corner of the box to the nearest generated one. "
        "Horizontal is along the water, between centroids; vertical is where the box stands."
    ),
    (
        "NEES is the squared error of the centroid in units of the pose's own covariance: 3 is "
        "right (2 along the water), more is too sure; a wrong height moves the centroid, too. "
        "Within: the share inside the 95 % the pose claims."
    ),
    "The paper gives no such errors: it has no truth. Intervals: images drawn anew 200 times.",
)
IOU_COUNTING = (
    "A pair is a graded pose and the human box that its detection covers best, above IoU 0.1.",
    (
        "The IoU is of that human box and the smallest rectangle around the projected 3D box, "
        "never of the detection: the pose was fitted to that. High overlap does not say that a "
        "heading is right."
    ),
    "Truth of simulated vessels is no human box and counts nowhere here.",
)


class ErrorOut(BaseModel):
    """Errors by absolute value; `bias` is their signed mean."""

    count: int
    median: float
    median_interval: Interval | None = Field(description="None of one image")
    mean: float
    p95: float
    bias: float

    @classmethod
    def of(cls, one: ErrorSummary) -> "ErrorOut":
        """Take the figures."""
        return cls(
            count=one.count,
            median=one.median,
            median_interval=one.median_interval,
            mean=one.mean,
            p95=one.p95,
            bias=one.bias,
        )


class CalibrationOut(BaseModel):
    """Whether poses know how far off they are; counts are of poses that say how sure they are."""

    mean_nees: float | None = Field(description="3 is right; null where no pose has a covariance")
    mean_nees_horizontal: float | None = Field(description="Along the water alone: 2 is right")
    position_within_95: ShareOut
    horizontal_within_95: ShareOut
    heading_within_95: ShareOut
    height_within_95: ShareOut

    @classmethod
    def of(cls, one: Calibration) -> "CalibrationOut":
        """Take the figures."""
        return cls(
            mean_nees=one.mean_nees,
            mean_nees_horizontal=one.mean_nees_horizontal,
            position_within_95=ShareOut.of(one.position),
            horizontal_within_95=ShareOut.of(one.horizontal),
            heading_within_95=ShareOut.of(one.heading),
            height_within_95=ShareOut.of(one.height),
        )


class PoseFiguresOut(BaseModel):
    """How the poses of a run did against truth; of all runs where `run_id` is null."""

    run_id: int | None
    label: str
    images: int
    poses: int
    match_rate: ShareOut
    wrong: ShareOut
    within_tenth_of_length: ShareOut = Field(description="ADD-S at most a tenth of the length")
    add_s_m: ErrorOut | None
    horizontal_m: ErrorOut | None
    vertical_m: ErrorOut | None
    heading_deg: ErrorOut | None
    height_m: ErrorOut | None
    calibration: CalibrationOut

    @classmethod
    def of(cls, one: PoseFigures) -> "PoseFiguresOut":
        """Take the figures."""
        errors = {
            kind: None if found is None else ErrorOut.of(found)
            for kind, found in one.errors.items()
        }
        return cls(
            run_id=one.run_id,
            label=one.label,
            images=one.images,
            poses=one.poses,
            match_rate=ShareOut.of(one.match_rate),
            wrong=ShareOut.of(one.wrong),
            within_tenth_of_length=ShareOut.of(one.near),
            calibration=CalibrationOut.of(one.calibration),
            **errors,
        )


class WorstOut(BaseModel):
    """A correct match whose pose is far off."""

    pose_id: int
    run_id: int
    image_id: int
    add_s_m: float
    horizontal_m: float
    vertical_m: float
    heading_deg: float
    height_m: float

    @classmethod
    def of(cls, one: Correct) -> "WorstOut":
        """Take the errors."""
        return cls(
            pose_id=one.pose.id,
            run_id=one.pose.run_id,
            image_id=one.pose.image_id,
            **{kind: getattr(one.error, kind) for kind in KINDS},
        )


class PosesOut(BaseModel):
    """Poses against truth."""

    whole: PoseFiguresOut | None = Field(description="Null where nothing is known to be true")
    runs: list[PoseFiguresOut]
    worst: list[WorstOut]
    counting: list[str]


def poses_out(table: PoseTable) -> PosesOut:
    """Write the table out."""
    return PosesOut(
        whole=None if table.whole is None else PoseFiguresOut.of(table.whole),
        runs=[PoseFiguresOut.of(one) for one in table.runs],
        worst=[WorstOut.of(one) for one in table.worst],
        counting=list(POSE_COUNTING),
    )


POSE_COLUMNS = (
    "run_id",
    "run",
    "error",
    "count",
    "median",
    "median_low",
    "median_high",
    "mean",
    "p95",
    "bias",
    "images",
    "poses",
    "matched",
    "matchable",
    "wrong",
    "mean_nees",
    "position_within_95",
)


def pose_rows(table: PosesOut) -> list[dict[str, object]]:
    """Return a line for each run and error, the whole first."""
    lines: list[dict[str, object]] = []
    for one in ([table.whole] if table.whole else []) + table.runs:
        for kind in KINDS:
            found: ErrorOut | None = getattr(one, kind)
            figures = {} if found is None else found.model_dump(exclude={"median_interval"})
            low, high = (found and found.median_interval) or (None, None)
            lines.append(
                {
                    "run_id": one.run_id,
                    "run": one.label,
                    "error": kind,
                    **figures,
                    "median_low": low,
                    "median_high": high,
                    "images": one.images,
                    "poses": one.poses,
                    "matched": one.match_rate.count,
                    "matchable": one.match_rate.total,
                    "wrong": one.wrong.count,
                    "mean_nees": one.calibration.mean_nees,
                    "position_within_95": one.calibration.position_within_95.share,
                }
            )
    return lines


class PairOut(BaseModel):
    """A graded pose and the human box of its vessel."""

    pose_id: int
    run_id: int
    image_id: int
    box_id: int
    grade: Grade
    iou: float


class GradeIouOut(BaseModel):
    """The IoU of a grade's pairs: mean with its 95 % interval, and quartiles."""

    count: int
    mean: float
    mean_interval: Interval | None = Field(description="None of one image")
    first_quartile: float
    median: float
    third_quartile: float


class IouOut(BaseModel):
    """IoU by grade, the paper's plot."""

    pairs: int
    poses: int = Field(description="Of the pipeline, in photographs that people drew boxes in")
    poses_ungraded: int
    poses_without_box: int = Field(description="Graded, but nobody drew a box where they are")
    clipped: bool = Field(description="Projected boxes end at the image's edge, as human ones do")
    by_grade: dict[Grade, GradeIouOut | None]
    each: list[PairOut]
    counting: list[str]
    paper_pairs: int
    paper_source: str


def iou_out(figures: IouFigures) -> IouOut:
    """Write the figures out."""
    return IouOut(
        pairs=len(figures.pairs),
        poses=figures.poses,
        poses_ungraded=figures.ungraded,
        poses_without_box=figures.without_box,
        clipped=figures.clipped,
        by_grade={
            grade: None
            if one is None
            else GradeIouOut(
                count=one.count,
                mean=one.mean,
                mean_interval=one.mean_interval,
                first_quartile=one.low,
                median=one.median,
                third_quartile=one.high,
            )
            for grade, one in figures.by_grade.items()
        },
        each=[
            PairOut(
                pose_id=pair.pose_id,
                run_id=pair.run_id,
                image_id=pair.image_id,
                box_id=pair.box_id,
                grade=pair.grade,
                iou=pair.iou,
            )
            for pair in figures.pairs
        ],
        counting=list(IOU_COUNTING),
        paper_pairs=PAPER_PAIRS,
        paper_source=IOU_SOURCE,
    )


IOU_COLUMNS = ("pose_id", "run_id", "image_id", "box_id", "grade", "iou")


def iou_rows(pairs: Sequence[PairOut]) -> list[dict[str, object]]:
    """Return a line for each pair."""
    return [pair.model_dump(mode="json") for pair in pairs]
