"""REST of AIS coverage: a day's images with what was heard around each, as JSON or CSV."""

import csv
import io
from datetime import date, datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from app.ais import coverage
from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.identities import service as identities
from app.sites.actions import site_for

router = APIRouter(tags=["AIS"])
Reader = Annotated[Access, allowed(Scope.READ)]
COLUMNS = ("image_id", "captured_at", "camera", "near", "in_view", "nearest_s")


class ImageCoverageOut(BaseModel):
    """An image and what was heard around it."""

    model_config = ConfigDict(from_attributes=True)

    image_id: int
    captured_at: datetime
    camera: str
    near: int = Field(description="Vessels heard within 3 minutes and 5 km of the site")
    in_view: int | None = Field(description="Those in the picture; null: not registered")
    nearest_s: float | None = Field(description="How far in time the nearest report is")
    withheld: int = Field(description="Vessels heard only by receivers whose clock is suspect")


class SourceCoverageOut(BaseModel):
    """A recording or a feed, and its longest silence of the day."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    positions: int
    first_at: datetime
    last_at: datetime
    longest_silence_s: float
    silent_since: datetime | None


class DayCoverageOut(BaseModel):
    """A day's coverage."""

    model_config = ConfigDict(from_attributes=True)

    day: date
    covered: int = Field(description="Images with a vessel near")
    images: list[ImageCoverageOut]
    sources: list[SourceCoverageOut]


@router.get(
    "/sites/{site_id}/ais/coverage",
    response_model=DayCoverageOut,
    responses={200: {"content": {"text/csv": {}}}},
)
def get_ais_coverage(
    site_id: int,
    session: SessionDep,
    access: Reader,
    day: Annotated[
        date | None, Query(description="A day in UTC; left out: the last one with images")
    ] = None,
    form: Annotated[Literal["json", "csv"], Query(alias="format")] = "json",
) -> object:
    """Tell for each image of a day which vessels were heard near it, and who was silent when."""
    site = site_for(session, access, Scope.READ, site_id)
    readable = identities.view(session, site.id).readable
    day = day or coverage.last_day(session, site.id)
    found = coverage.of_day(session, site, readable, day)
    if form == "json":
        return DayCoverageOut.model_validate(found)
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(COLUMNS)
    for image in found.images:
        values = ImageCoverageOut.model_validate(image).model_dump(mode="json")
        lines.writerow(["" if values[name] is None else values[name] for name in COLUMNS])
    return Response(
        text.getvalue(),
        media_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="coverage-{day}.csv"'},
    )
