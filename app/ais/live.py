"""Storing what a live feed brings, as a recording's reports are stored: no fix twice."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.ais import import_repository, live_repository
from app.ais.importing import vessel_rows
from app.ais.rows import in_range, printable
from app.ais.summary import RecordingSummary
from app.domain.ais import PositionReport, StaticReport
from app.domain.cells import cell_of, hour_of
from app.domain.plausibility import is_contradicted

Row = dict[str, Any]


class Arrived(NamedTuple):
    """A report and when it came, by our own clock."""

    report: PositionReport | StaticReport
    arrived_at: datetime


@dataclass(frozen=True, slots=True)
class Known:
    """How many messages told only what was stored before."""

    known_positions: int
    known_statics: int


def store_reports(
    session: Session,
    site_id: int,
    feed_id: int,
    arrived: Sequence[Arrived],
) -> Known:
    """Store a feed's reports in the session's transaction; short, so a few thousand at most.

    What a receiver heard at a time that its arrival contradicts is stored as `clock_suspect`. A
    type 19 message is a position with statics beside it, and counts as the position alone.
    """
    summary = RecordingSummary()
    positions: list[Row] = []
    statics: list[Row] = []
    beside: list[Row] = []
    origin: Row = {"site_id": site_id, "feed_id": feed_id}
    position_type = 0
    for report, arrived_at in arrived:
        summary.add(report)
        told = origin | {"arrived_at": arrived_at}
        if not isinstance(report, StaticReport):
            position_type = report.message_type
            lag_s = (arrived_at - report.received_at).total_seconds()
            told["clock_suspect"] = is_contradicted(lag_s)
            positions.append(told | _position_row(report))
            continue
        (beside if position_type == 19 else statics).append(told | _static_row(report))
        position_type = 0
    live_repository.take_turns(session, site_id)
    live_repository.add_statics(session, beside)
    known = Known(
        len(positions) - live_repository.add_positions(session, positions),
        len(statics) - live_repository.add_statics(session, statics),
    )
    import_repository.update_vessels(session, vessel_rows(summary))
    return known


def _position_row(report: PositionReport) -> Row:
    row = asdict(report)
    del row["report_id"]
    row["fix_time_source"] = report.fix_time_source.value
    row["hour"] = hour_of(report.fix_time)
    row["cell"] = cell_of(report.lat_deg, report.lon_deg)
    return row


def _static_row(report: StaticReport) -> Row:
    row = asdict(report)
    del row["report_id"]
    row["name"] = printable(report.name, 64)
    row["callsign"] = printable(report.callsign, 16)
    row["imo"] = in_range(report.imo)
    row["ship_type"] = in_range(report.ship_type)
    return row
