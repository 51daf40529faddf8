"""REST of the plots: each page's drawing as an SVG file."""

from fastapi import APIRouter, Response

from app.dependencies import SessionDep
from app.evaluation import selection
from app.evaluation.answers import svg_file
from app.evaluation.detector_pages import ClassSetName, detector_plot
from app.evaluation.detector_router import NarrowedDep
from app.evaluation.detector_schemas import detectors_out
from app.evaluation.detectors import detector_table
from app.evaluation.iou import iou_figures
from app.evaluation.poses import pose_table
from app.evaluation.router import AskedDep, Reader
from app.evaluation.truth_pages import iou_plot, pose_plot
from app.evaluation.truth_router import Clip
from app.evaluation.truth_schemas import iou_out

router = APIRouter(tags=["evaluation"], prefix="/evaluation")
SVG: dict[int | str, dict[str, object]] = {
    200: {"description": "The plot as an SVG file", "content": {"image/svg+xml": {}}}
}


@router.get("/detectors.svg", response_class=Response, responses=SVG)
def draw_detectors(
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    only: NarrowedDep,
    class_set: ClassSetName = "moving",
) -> Response:
    """Return precision over recall at IoU 0.5 as an SVG file."""
    chosen = selection.select(session, access, asked)
    table = detector_table(session, chosen, model_id=only.model_id, file_id=only.file_id)
    return svg_file("precision-over-recall", detector_plot(detectors_out(table), class_set))


@router.get("/iou.svg", response_class=Response, responses=SVG)
def draw_iou(
    session: SessionDep, access: Reader, asked: AskedDep, *, clip: Clip = True
) -> Response:
    """Return IoU by grade as an SVG file."""
    chosen = selection.select(session, access, asked)
    return svg_file(
        "iou-by-grade", iou_plot(iou_out(iou_figures(session, chosen, clip=clip)), access)
    )


@router.get("/poses.svg", response_class=Response, responses=SVG)
def draw_poses(session: SessionDep, access: Reader, asked: AskedDep) -> Response:
    """Return the shares of poses by their error as an SVG file."""
    table = pose_table(session, selection.select(session, access, asked))
    return svg_file("poses-against-truth", pose_plot(table))
