"""What an export may select by: allow-listed fields, never relations of a caller's choosing."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.ids import RowId
from app.tables.reviews import Grade


class ExportFilters(BaseModel):
    """All given filters must hold; an empty list of grades means any, graded or not.

    `poses` chooses no poses, but which of their boxes is written.
    """

    model_config = ConfigDict(extra="forbid")

    run_id: RowId | None = None
    site_id: RowId | None = None
    camera_id: RowId | None = None
    grade: Annotated[list[Grade] | None, Field(max_length=len(Grade))] = None
    poses: Annotated[
        Literal["generated", "corrected"] | None,
        Field(
            description="`corrected`: as people corrected them where they did; else as generated"
        ),
    ] = None
