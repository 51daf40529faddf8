"""REST of the paper's projection table."""

from dataclasses import asdict, dataclass
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from app.dependencies import SessionDep
from app.evaluation import selection
from app.evaluation.projection import METHODS, ProjectionFigures, ViewportErrors, projection_figures
from app.evaluation.router import AskedDep, Reader, csv_or_json
from app.evaluation.tables import TableFormat, csv_response
from app.tables.registration import RegistrationMethod

router = APIRouter(tags=["evaluation"], prefix="/evaluation")


@dataclass(frozen=True, slots=True)
class Published:
    """A line of the paper's table as printed."""

    mae_px: float
    mae_pct_width: float
    mae_pct_height: float


PAPER_SOURCE = (
    "BONK-pose paper, table of projection errors: mean over keypoints and viewports, "
    "2560 x 1920 px; percentages of the homographies follow from their pixels"
)
PAPER = {
    RegistrationMethod.PNP: Published(12.22, 0.48, 0.64),
    RegistrationMethod.HOMOGRAPHY_WATER: Published(61.88, 2.42, 3.22),
    RegistrationMethod.HOMOGRAPHY_PCA: Published(59.96, 2.34, 3.12),
}
METHOD_NAMES = {
    RegistrationMethod.PNP: "PnP",
    RegistrationMethod.HOMOGRAPHY_WATER: "Homography, water surface",
    RegistrationMethod.HOMOGRAPHY_PCA: "Homography, PCA axes",
}
COLUMNS = (
    "method",
    "mae_px",
    "mae_pct_width",
    "mae_pct_height",
    "leave_one_out_px",
    "keypoints",
    "viewports",
    "paper_mae_px",
    "paper_mae_pct_width",
    "paper_mae_pct_height",
)


class PaperOut(BaseModel):
    """The paper's figures for a method."""

    mae_px: float
    mae_pct_width: float
    mae_pct_height: float


class MethodFiguresOut(BaseModel):
    """A method's errors, averaged over the keypoints of all viewports it could solve."""

    method: RegistrationMethod
    label: str
    mae_px: float | None
    mae_pct_width: float | None
    mae_pct_height: float | None
    leave_one_out_px: float | None
    keypoints: int
    viewports: int
    paper: PaperOut


class ViewportMethodOut(BaseModel):
    """A viewport's mean errors by a method, or why it could not be solved."""

    method: RegistrationMethod
    mae_px: float | None
    leave_one_out_px: float | None
    reason: str | None


class ViewportErrorsOut(BaseModel):
    """A viewport behind the table."""

    viewport_id: int
    name: str
    control_keypoints: int
    methods: list[ViewportMethodOut]


class ProjectionOut(BaseModel):
    """The paper's projection table over all viewports, the paper's figures beside it."""

    methods: list[MethodFiguresOut]
    viewports: list[ViewportErrorsOut]
    viewports_considered: int = Field(description="Of the selection, with keypoints or without")
    paper_source: str


def projection_out(figures: ProjectionFigures) -> ProjectionOut:
    """Show the table."""
    return ProjectionOut(
        methods=[
            MethodFiguresOut(
                label=METHOD_NAMES[one.method],
                paper=PaperOut(**asdict(PAPER[one.method])),
                **asdict(one),
            )
            for one in figures.methods
        ],
        viewports=[_viewport(one) for one in figures.viewports],
        viewports_considered=figures.considered,
        paper_source=PAPER_SOURCE,
    )


def _viewport(one: ViewportErrors) -> ViewportErrorsOut:
    return ViewportErrorsOut(
        viewport_id=one.viewport.id,
        name=one.viewport.name,
        control_keypoints=one.control,
        methods=[
            ViewportMethodOut(
                method=method,
                mae_px=_mean(one.by_method[method].errors_px),
                leave_one_out_px=_mean(one.by_method[method].left_out_px),
                reason=one.by_method[method].reason,
            )
            for method in METHODS
        ],
    )


def _mean(values: tuple[float, ...]) -> float | None:
    return sum(values) / len(values) if values else None


@router.get(
    "/projection",
    response_model=ProjectionOut,
    responses=csv_or_json("The table; as CSV a line a method"),
)
def evaluate_projection(
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    output: Annotated[TableFormat, Query(alias="format")] = TableFormat.JSON,
) -> ProjectionOut | Response:
    """Return the paper's projection table over all viewports, the paper's figures beside ours."""
    chosen = selection.select(session, access, asked)
    answer = projection_out(projection_figures(session, chosen))
    if output is TableFormat.JSON:
        return answer
    rows = [
        one.model_dump(mode="json") | {f"paper_{k}": v for k, v in one.paper.model_dump().items()}
        for one in answer.methods
    ]
    return csv_response("quaymark-projection", COLUMNS, rows)
