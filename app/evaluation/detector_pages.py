"""The page of the paper's detector table, with precision over recall as a plot."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.auth.access import Scope
from app.dependencies import SessionDep
from app.domain.average_precision import RECALL_LEVELS
from app.evaluation import selection
from app.evaluation.detector_figures import CLASS_SETS
from app.evaluation.detector_router import NarrowedDep
from app.evaluation.detector_schemas import DetectorTableOut, detectors_out
from app.evaluation.detectors import detector_table
from app.evaluation.pages import show_in_frame
from app.evaluation.plots import COLOURS, Curve, Plot, curve, shares_x, shares_y
from app.evaluation.router import AskedDep, Reader

router = APIRouter()

SET_NAMES = {
    "moving": "Moving: ship, ship_leaving_frame, subvessel",
    "moving_others_ignored": "Moving, other vessels ignored",
    "all": "All five classes",
}
ClassSetName = Annotated[
    str, Query(alias="class_set", pattern=f"^({'|'.join(one.name for one in CLASS_SETS)})$")
]


@router.get("/evaluation/detectors")
def show_detectors(
    request: Request,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    only: NarrowedDep,
    class_set: ClassSetName = "moving",
) -> Response:
    """Show how well detectors find the vessels that people drew boxes around."""
    chosen = selection.select(session, access, asked)
    table = detectors_out(
        detector_table(session, chosen, model_id=only.model_id, file_id=only.file_id)
    )
    more = {"model_id": only.model_id, "file_id": only.file_id}
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/detectors.html",
        table=table,
        plot=detector_plot(table, class_set),
        class_set=class_set,
        set_names=SET_NAMES,
        ways=[
            {
                "label": name,
                "href": asked.query(**more, class_set=key),
                "current": key == class_set,
            }
            for key, name in SET_NAMES.items()
        ],
        rest=f"/api/v1/evaluation/detectors{asked.query(**more)}",
        csv=f"/api/v1/evaluation/detectors{asked.query(**more, format='csv')}",
        svg=f"/api/v1/evaluation/detectors.svg{asked.query(**more, class_set=class_set)}",
        may_draw=access.may_anywhere(Scope.REVIEW),
    )


def detector_plot(table: DetectorTableOut, class_set: str) -> Plot:
    """Draw precision over recall of the detectors, the best first."""
    curves: list[Curve] = []
    for one in table.detectors:
        figures = next(found for found in one.class_sets if found.class_set == class_set)
        if figures.curve:
            points = zip(RECALL_LEVELS, figures.curve["iou_50"], strict=True)
            name = f"{one.label} (AP {figures.map_50 or 0:.3f})"
            curves.append(curve(len(curves), name, [(float(x), y) for x, y in points]))
    drawn = curves[: len(COLOURS)]
    left_out = f" The best {len(drawn)} are drawn." if len(drawn) < len(curves) else ""
    return Plot(
        title=f"Precision over recall at IoU 0.5; {SET_NAMES[class_set]}",
        x_label="Recall",
        y_label="Precision",
        x_ticks=shares_x(),
        y_ticks=shares_y(),
        curves=drawn,
        remark=f"Precision over recall at IoU 0.5, over all scores a detector keeps.{left_out}",
    )
