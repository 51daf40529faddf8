"""REST of poses against truth, and of projected boxes against those that people drew."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.dependencies import SessionDep
from app.evaluation import selection
from app.evaluation.answers import tagged
from app.evaluation.iou import iou_figures
from app.evaluation.poses import pose_table
from app.evaluation.router import AskedDep, Reader, csv_or_json
from app.evaluation.tables import TableFormat
from app.evaluation.truth_schemas import (
    IOU_COLUMNS,
    POSE_COLUMNS,
    IouOut,
    PosesOut,
    iou_out,
    iou_rows,
    pose_rows,
    poses_out,
)

router = APIRouter(tags=["evaluation"], prefix="/evaluation")

Output = Annotated[TableFormat, Query(alias="format")]
Clip = Annotated[bool, Query(description="Cut projected boxes off at the image's edge")]


@router.get(
    "/poses",
    response_model=PosesOut,
    responses=csv_or_json("The figures; as CSV a line for each run and kind of error"),
)
def evaluate_poses(
    request: Request,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    output: Output = TableFormat.JSON,
) -> Response:
    """Compare poses with known truth, where a site has it: ADD-S, position, heading, height.

    With the match rate, and whether poses that say how sure they are were right about that.
    """
    answer = poses_out(pose_table(session, selection.select(session, access, asked)))
    return tagged(request, output, answer, "poses", POSE_COLUMNS, pose_rows(answer))


@router.get(
    "/iou",
    response_model=IouOut,
    responses=csv_or_json("The figures; as CSV a line for each pair"),
)
def evaluate_iou(
    request: Request,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    output: Output = TableFormat.JSON,
    *,
    clip: Clip = True,
) -> Response:
    """Compare projected 3D boxes with the boxes that people drew, by grade, as the paper's plot."""
    chosen = selection.select(session, access, asked)
    answer = iou_out(iou_figures(session, chosen, clip=clip))
    return tagged(request, output, answer, "iou", IOU_COLUMNS, iou_rows(answer.each))
