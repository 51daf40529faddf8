"""Storing what a live feed brings, as a recording's reports are stored: no fix twice."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from sqlalchemy.orm import Session

from app.ais import import_repository, live_repository
from app.ais.importing import vessel_rows
from app.ais.spool import in_range, printable
from app.ais.summary import RecordingSummary
from app.domain.ais import PositionReport, StaticReport
from app.domain.cells import cell_of


@dataclass(frozen=True, slots=True)
class Stored:
    """How many reports were new; the others were known already."""

    positions: int
    statics: int


def store_reports(
    session: Session,
    site_id: int,
    feed_id: int,
    reports: Sequence[PositionReport | StaticReport],
) -> Stored:
    """Store a feed's reports in the session's transaction; short, so a few thousand at most."""
    summary = RecordingSummary()
    positions, statics = [], []
    origin = {"site_id": site_id, "feed_id": feed_id}
    for report in reports:
        summary.add(report)
        if isinstance(report, StaticReport):
            statics.append(origin | _static_row(report))
        else:
            positions.append(origin | _position_row(report))
    live_repository.take_turns(session, site_id)
    stored = Stored(
        live_repository.add_positions(session, positions),
        live_repository.add_statics(session, statics),
    )
    import_repository.update_vessels(session, vessel_rows(summary))
    return stored


def _position_row(report: PositionReport) -> dict[str, object]:
    row = asdict(report)
    del row["report_id"]
    row["fix_time_source"] = report.fix_time_source.value
    row["cell"] = cell_of(report.lat_deg, report.lon_deg)
    return row


def _static_row(report: StaticReport) -> dict[str, object]:
    row = asdict(report)
    row["name"] = printable(report.name, 64)
    row["callsign"] = printable(report.callsign, 16)
    row["imo"] = in_range(report.imo)
    row["ship_type"] = in_range(report.ship_type)
    return row
