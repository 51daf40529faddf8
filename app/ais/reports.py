"""AIS rows as the domain's reports: what fusion and tracks read, each with the id of its row."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.ais import report_repository
from app.ais.area import Area
from app.domain.ais import FixTimeSource, PositionReport, StaticReport
from app.domain.vessel_statics import hull_of

_LATELY = timedelta(hours=2)  # vessels say their statics every six minutes


class ReportWindow(NamedTuple):
    """Positions, oldest first, and by MMSI what their vessels said of themselves, oldest first.

    Statics are what they said within two hours of the window, and for those that told no size
    before its beginning all that they ever said of their size. So the latest size is always there,
    and the work does not grow with the years.

    `withheld` and `arrived` are positions whose receiver's clock is suspect, nothing to match with:
    by the times that the receiver told, and by those at which they came.
    """

    positions: list[PositionReport]
    statics: dict[int, list[StaticReport]]
    withheld: list[PositionReport]
    arrived: list[PositionReport]


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
    positions: list[PositionReport] = []
    withheld: list[PositionReport] = []
    seen: set[tuple[object, ...]] = set()
    for *row, is_suspect in report_repository.position_rows(session, readable, start, end, area):
        # The same fix may stand in a site's file and in one shared by all: it is one report.
        fix = (row[0], row[1], row[3], row[4], bool(is_suspect))
        if fix not in seen:
            seen.add(fix)
            (withheld if is_suspect else positions).append(_report(row))
    arrived = [
        _as_it_came(_report(row), arrived_at)
        for *row, _, arrived_at in report_repository.suspect_rows(
            session, readable, start, end, area
        )
    ]
    vessels = frozenset(report.mmsi for report in (*positions, *withheld, *arrived))
    statics = _statics(session, readable, vessels, start, end)
    return ReportWindow(positions, statics, withheld, arrived)


def _report(row: Sequence[Any]) -> PositionReport:
    """Return the report of the first 14 columns."""
    fields: tuple[Any, ...] = (*row[:12], FixTimeSource(row[12]), row[13])
    return PositionReport(*fields)


def _as_it_came(report: PositionReport, arrived_at: datetime) -> PositionReport:
    """Return a report as old at its arrival as it was when its receiver heard it."""
    age = report.received_at - report.fix_time
    return replace(report, fix_time=arrived_at - age)


def _statics(
    session: Session,
    readable: frozenset[int],
    vessels: frozenset[int],
    start: datetime,
    end: datetime,
) -> dict[int, list[StaticReport]]:
    lately = start - _LATELY, end + _LATELY
    statics: dict[int, list[StaticReport]] = {}
    sized = set()
    for row in report_repository.static_rows(session, readable, vessels, *lately):
        static = StaticReport(*row)
        statics.setdefault(static.mmsi, []).append(static)
        if static.received_at <= start and hull_of(static) is not None:
            sized.add(static.mmsi)
    for row in report_repository.size_rows(session, readable, vessels - sized, *lately):
        statics.setdefault(row[0], []).append(StaticReport(*row))
    for mmsi in vessels - sized:
        statics.get(mmsi, []).sort(key=lambda static: static.received_at)
    return statics
