"""REST and page of the paper's detector table."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from app.dependencies import SessionDep
from app.evaluation import selection
from app.evaluation.answers import tagged
from app.evaluation.detector_schemas import CSV_COLUMNS, DetectorTableOut, csv_rows, detectors_out
from app.evaluation.detectors import detector_table
from app.evaluation.router import AskedDep, Reader, csv_or_json
from app.evaluation.selection import Id
from app.evaluation.tables import TableFormat

router = APIRouter(tags=["evaluation"], prefix="/evaluation")


@dataclass(frozen=True, slots=True)
class Narrowed:
    """One detector, one imported file of boxes; None: all."""

    model_id: int | None
    file_id: int | None


async def narrowed(
    model_id: Annotated[Id, Query(description="Only this detector")] = None,
    file_id: Annotated[Id, Query(description="Only boxes of this imported COCO file")] = None,
) -> Narrowed:
    """Read what the query is narrowed to."""
    return Narrowed(model_id, file_id)


NarrowedDep = Annotated[Narrowed, Depends(narrowed)]


@router.get(
    "/detectors",
    response_model=DetectorTableOut,
    responses=csv_or_json("The table; as CSV a line for each detector, class set and size"),
)
def evaluate_detectors(
    request: Request,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    only: NarrowedDep,
    output: Annotated[TableFormat, Query(alias="format")] = TableFormat.JSON,
) -> Response:
    """Return mAP@.5:.95, mAP@.5 and AR@100 of detectors against boxes by people, as pycocotools.

    Both class sets of the paper, over all sizes and by size, with the paper's figures beside them.
    """
    chosen = selection.select(session, access, asked)
    table = detectors_out(
        detector_table(session, chosen, model_id=only.model_id, file_id=only.file_id)
    )
    return tagged(request, output, table, "detectors", CSV_COLUMNS, csv_rows(table))
