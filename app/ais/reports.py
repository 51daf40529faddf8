"""AIS rows as the domain's reports: what fusion and tracks read, each with the id of its row."""

from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.ais import report_repository
from app.ais.area import Area
from app.domain.ais import FixTimeSource, PositionReport, StaticReport


class ReportWindow(NamedTuple):
    """Positions, oldest first, and by MMSI all that their vessels ever said of themselves."""

    positions: list[PositionReport]
    statics: dict[int, list[StaticReport]]


def reports_between(
    session: Session, site_id: int, start: datetime, end: datetime, area: Area | None = None
) -> ReportWindow:
    """Return what was heard around a site in a time window, for making vessel states.

    Args:
        session: only reads.
        site_id: reports of this site and those shared by all sites count.
        start: first fix time wanted; begin well before the first image, because the state of a
            vessel needs the report before it, and Hermite interpolation the one after it too.
        end: last fix time wanted.
        area: a box around the camera, such as `Area.around(lat_deg, lon_deg, radius_m)`.

    Returns:
        Positions and statics, both oldest first. `report_id` is the row's id in `ais_positions`.

    """
    readable = frozenset((site_id,))
    positions = []
    seen: set[tuple[object, ...]] = set()
    for row in report_repository.position_rows(session, readable, start, end, area):
        # The same fix may stand in a site's file and in one shared by all: it is one report.
        fix = (row[0], row[1], row[3], row[4])
        if fix not in seen:
            seen.add(fix)
            fields: tuple[Any, ...] = (*row[:12], FixTimeSource(row[12]), row[13])
            positions.append(PositionReport(*fields))
    statics: dict[int, list[StaticReport]] = {}
    for row in report_repository.static_rows(session, readable, start, end, area):
        statics.setdefault(row[0], []).append(StaticReport(*row))
    return ReportWindow(positions, statics)
