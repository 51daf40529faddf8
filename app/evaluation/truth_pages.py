"""Pages of poses against truth and of IoU by grade, each with its plot."""

from bisect import bisect_right

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope
from app.dependencies import SessionDep
from app.evaluation import selection
from app.evaluation.iou import iou_figures
from app.evaluation.pages import show_in_frame
from app.evaluation.plots import (
    COLOURS,
    Plot,
    Point,
    Spread,
    Tick,
    curve,
    place_x,
    place_y,
    shares_x,
    shares_y,
)
from app.evaluation.poses import PoseTable, pose_table
from app.evaluation.router import AskedDep, Reader
from app.evaluation.truth_router import Clip
from app.evaluation.truth_schemas import IouOut, iou_out, poses_out
from app.tables.reviews import Grade

router = APIRouter()

GRADE_NAMES = {Grade.GOOD: "Good", Grade.OK: "OK", Grade.BAD: "Bad", Grade.WRONG: "Wrong match"}
GRADE_COLOURS = dict(zip(Grade, (COLOURS[2], COLOURS[0], COLOURS[1], COLOURS[3]), strict=True))
ERROR_NAMES = {
    "add_s_m": "ADD-S, m",
    "horizontal_m": "Horizontal, m",
    "vertical_m": "Vertical, m",
    "heading_deg": "Heading, °",
    "height_m": "Height, m",
}
MOST_POINTS = 1500
_GOLDEN = 0.618034  # spreads dots evenly, the same way every time
_SAMPLES = 80


@router.get("/evaluation/iou")
def show_iou(
    request: Request, session: SessionDep, access: Reader, asked: AskedDep, *, clip: Clip = True
) -> Response:
    """Show how far projected boxes cover human ones, by grade."""
    chosen = selection.select(session, access, asked)
    table = iou_out(iou_figures(session, chosen, clip=clip))
    more = {} if clip else {"clip": "false"}
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/iou.html",
        table=table,
        plot=iou_plot(table, access),
        grades=GRADE_NAMES,
        rest=f"/api/v1/evaluation/iou{asked.query(**more)}",
        csv=f"/api/v1/evaluation/iou{asked.query(**more, format='csv')}",
        svg=f"/api/v1/evaluation/iou.svg{asked.query(**more)}",
    )


def iou_plot(table: IouOut, access: Access) -> Plot:
    """Draw a point for each pair, leading to its pose, and quartiles for each grade."""
    middle = {grade: (n + 0.5) / len(Grade) for n, grade in enumerate(Grade)}
    every = -(-len(table.each) // MOST_POINTS) or 1
    opens_review = access.may_anywhere(Scope.REVIEW)
    points = [
        Point(
            x=place_x(middle[pair.grade] + ((n * _GOLDEN) % 1 - 0.5) * 0.12),
            y=place_y(pair.iou),
            colour=GRADE_COLOURS[pair.grade],
            href=f"/runs/{pair.run_id}/review?pose={pair.pose_id}"
            if opens_review
            else f"/images/{pair.image_id}",
            words=f"Pose {pair.pose_id}: {GRADE_NAMES[pair.grade]}, IoU {pair.iou:.3f}",
        )
        for n, pair in enumerate(table.each[::every])
    ]
    counts = {grade: one.count if one else 0 for grade, one in table.by_grade.items()}
    drawn = f" One point in {every} is drawn." if every > 1 else ""
    return Plot(
        title=f"IoU of human boxes and projected boxes by grade, {table.pairs} pairs",
        x_label="Grade by people",
        y_label="IoU with the human box",
        x_ticks=[
            Tick(place_x(middle[grade]), f"{name} ({counts[grade]})")
            for grade, name in GRADE_NAMES.items()
        ],
        y_ticks=shares_y(),
        points=points,
        spreads=[
            Spread(
                place_x(middle[grade]),
                place_y(one.first_quartile),
                place_y(one.median),
                place_y(one.third_quartile),
            )
            for grade, one in table.by_grade.items()
            if one is not None
        ],
        remark="Each point is a pose and leads to it; boxes run from the first to the third "
        f"quartile, the thick line is the median.{drawn}",
    )


@router.get("/evaluation/poses")
def show_poses(request: Request, session: SessionDep, access: Reader, asked: AskedDep) -> Response:
    """Show how far poses are from known truth."""
    chosen = selection.select(session, access, asked)
    table = pose_table(session, chosen)
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/poses.html",
        table=poses_out(table),
        plot=pose_plot(table),
        errors=ERROR_NAMES,
        may_open=access.may_anywhere(Scope.REVIEW),
        rest=f"/api/v1/evaluation/poses{asked.query()}",
        csv=f"/api/v1/evaluation/poses{asked.query(format='csv')}",
        svg=f"/api/v1/evaluation/poses.svg{asked.query()}",
    )


def pose_plot(table: PoseTable) -> Plot:
    """Draw the share of each run's correct matches below an error."""
    runs = [one for one in table.runs if one.add_s_m]
    reach = max((one.errors["add_s_m"].p95 for one in runs if one.errors["add_s_m"]), default=1.0)
    step = next((s for s in (0.5, 1, 2, 5, 10, 20, 50, 100) if reach <= 5 * s), 200.0)
    most = 5 * step
    curves = [
        curve(
            n,
            f"{one.label} ({len(one.add_s_m)} poses)",
            [
                (x / _SAMPLES, bisect_right(one.add_s_m, most * x / _SAMPLES) / len(one.add_s_m))
                for x in range(_SAMPLES + 1)
            ],
        )
        for n, one in enumerate(runs[-len(COLOURS) :])
    ]
    return Plot(
        title="Share of correct matches by ADD-S against truth",
        x_label="ADD-S at most, m",
        y_label="Share of correct matches",
        x_ticks=[Tick(tick.at, f"{most * n / 5:g}") for n, tick in enumerate(shares_x())],
        y_ticks=shares_y(),
        curves=curves,
        remark="Further up and left is better. Wrong matches are not in the curves.",
    )
