"""What an export may select by: allow-listed fields, never relations of a caller's choosing."""

from pydantic import BaseModel, ConfigDict

from app.tables.reviews import Grade


class ExportFilters(BaseModel):
    """All given filters must hold; an empty list of grades means any, graded or not."""

    model_config = ConfigDict(extra="forbid")

    run_id: int | None = None
    site_id: int | None = None
    camera_id: int | None = None
    grade: list[Grade] | None = None
