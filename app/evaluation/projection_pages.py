"""The page of the paper's projection table."""

from fastapi import APIRouter, Request, Response

from app.dependencies import SessionDep
from app.evaluation import selection
from app.evaluation.pages import show_in_frame
from app.evaluation.projection import projection_figures
from app.evaluation.projection_router import projection_out
from app.evaluation.router import AskedDep, Reader

router = APIRouter()


@router.get("/evaluation/projection")
def show_projection(
    request: Request, session: SessionDep, access: Reader, asked: AskedDep
) -> Response:
    """Show how well each method projects the landmarks of all viewports."""
    chosen = selection.select(session, access, asked)
    return show_in_frame(
        request,
        session,
        access,
        chosen,
        "evaluation/projection.html",
        table=projection_out(projection_figures(session, chosen)),
        rest=f"/api/v1/evaluation/projection{asked.query()}",
        csv=f"/api/v1/evaluation/projection{asked.query(format='csv')}",
    )
