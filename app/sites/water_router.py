"""REST of water levels: a site's series, and the level at a moment."""

from datetime import datetime
from typing import Annotated, Any, Self

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, Field

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.db import now
from app.dependencies import SessionDep
from app.errors import Invalid, TooLarge
from app.openapi_bodies import file_answer, text_body
from app.sites import actions, water, water_actions
from app.sites.fields import HIGHEST_M, in_zone
from app.sites.water_csv import COLUMNS, parse_levels
from app.tables.water import WaterLevelSource

router = APIRouter(tags=["sites"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
MOST_BYTES = 10_000_000


class GapOut(BaseModel):
    """A time without readings, in which the site's constant level holds."""

    begin: datetime
    end: datetime
    hours: float


class SeriesOut(BaseModel):
    """A site's water level: the constant, and what there is of a series."""

    constant_m: float
    readings: int
    begin: datetime | None
    end: datetime | None
    lowest_m: float | None
    highest_m: float | None
    gap_count: int
    gaps: list[GapOut] = Field(description="The first ones longer than 3 hours")

    @classmethod
    def of(cls, constant_m: float, series: water.Series) -> Self:
        """Sum a series up."""
        levels = [level_m for _, level_m in series.readings]
        return cls(
            constant_m=constant_m,
            readings=len(levels),
            begin=series.readings[0][0] if levels else None,
            end=series.readings[-1][0] if levels else None,
            lowest_m=min(levels, default=None),
            highest_m=max(levels, default=None),
            gap_count=len(series.gaps),
            gaps=[
                GapOut(begin=begin, end=end, hours=(end - begin).total_seconds() / 3600)
                for begin, end in series.gaps[: water.GAPS_SHOWN]
            ],
        )


class LevelOut(BaseModel):
    """The water level at a moment, above the WGS84 ellipsoid."""

    at: datetime
    level_m: float
    source: WaterLevelSource


AS_CSV: Any = {"response_class": Response, "responses": file_answer("text/csv")}
SERIES = text_body("text/csv", "time,level_m\n2026-11-22T10:00:00Z,41.2\n")


async def _text(request: Request) -> str:
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MOST_BYTES:
            raise TooLarge(f"a series has at most {MOST_BYTES} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Invalid.field("table", "is no text in UTF-8; save it as CSV UTF-8") from error


@router.get("/sites/{site_id:int}/water-levels")
def get_water_levels(site_id: int, session: SessionDep, access: Reader) -> SeriesOut:
    """Sum up a site's water levels."""
    site = actions.site_for(session, access, Scope.READ, site_id)
    return SeriesOut.of(site.water_level_m, water.series_of(session, site))


@router.post("/sites/{site_id:int}/water-levels", openapi_extra=SERIES)
def replace_water_levels(
    site_id: int,
    text: Annotated[str, Depends(_text)],
    session: SessionDep,
    access: Registrar,
    offset_m: Annotated[
        float,
        Query(ge=-HIGHEST_M, le=HIGHEST_M, description="Gauge datum above the ellipsoid"),
    ] = 0.0,
) -> SeriesOut:
    """Replace a site's series by a CSV table `time,level_m`, all or nothing.

    The series before can be restored for 30 days, once the new one is deleted.
    """
    site = actions.site_for(session, access, Scope.REGISTER, site_id)
    readings = parse_levels(text, site.timezone, offset_m)
    return SeriesOut.of(site.water_level_m, water_actions.replace(session, access, site, readings))


@router.delete("/sites/{site_id:int}/water-levels", status_code=204)
def delete_water_levels(site_id: int, session: SessionDep, access: Registrar) -> None:
    """Delete a site's series; its constant level holds again. It can be restored for 30 days."""
    site = actions.site_for(session, access, Scope.REGISTER, site_id)
    water_actions.remove(session, access, site)


@router.get(
    "/sites/{site_id:int}/water-levels.csv",
    response_class=Response,
    responses=file_answer("text/csv"),
)
def water_levels_as_csv(site_id: int, session: SessionDep, access: Reader) -> Response:
    """Return a site's series as CSV."""
    site = actions.site_for(session, access, Scope.READ, site_id)
    lines = [",".join(COLUMNS)]
    for moment, level_m in water.series_of(session, site).readings:
        lines.append(f"{moment.isoformat().replace('+00:00', 'Z')},{level_m!r}")
    return Response("\n".join(lines) + "\n", media_type="text/csv")


@router.get("/sites/{site_id:int}/water-level")
def get_water_level(
    site_id: int,
    session: SessionDep,
    access: Reader,
    at: Annotated[datetime | None, Query(description="ISO 8601; now when left out")] = None,
) -> LevelOut:
    """Tell the water level at a moment, as fusion takes it."""
    site = actions.site_for(session, access, Scope.READ, site_id)
    moment = in_zone(at, site.timezone, "at") if at is not None else now()
    level = water.level_at(session, site, moment)
    return LevelOut(at=moment, level_m=level.level_m, source=level.source)
