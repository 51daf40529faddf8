"""The vessels around a camera at the moment of one image, from stored reports."""

from collections import defaultdict
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.service import reports_between
from app.domain.ais import PositionReport
from app.domain.fusion_settings import FusionSettings, Preset
from app.domain.geodesy import Geodetic
from app.domain.tracks import TrackMethod, TrackSettings, state_at
from app.domain.vessel_state import VesselState


def states_around(
    session: Session, site_id: int, camera_at: Geodetic, at: datetime, settings: FusionSettings
) -> list[VesselState]:
    """Return the states of all vessels heard lately within range of the camera, by MMSI.

    A vessel whose reports do not suffice for a state (no heading, no size) is left out. Preset
    `paper` looks back only, as published; others use what was heard after the image too.
    """
    is_paper = settings.preset is Preset.PAPER
    tracking = TrackSettings(
        method=TrackMethod.HEADING_DR if is_paper else TrackMethod.HERMITE,
        max_age_s=settings.maximum_report_age_s,
    )
    ahead_s = 0.0 if is_paper else settings.maximum_report_age_s
    # A ship of 50 kn covers 1.5 km in a minute: what comes into range was heard outside it.
    reach_m = settings.maximum_range_m + 26 * settings.maximum_report_age_s
    positions, statics = reports_between(
        session,
        site_id,
        at - timedelta(seconds=settings.maximum_report_age_s),
        at + timedelta(seconds=ahead_s),
        Area.around(camera_at.lat_deg, camera_at.lon_deg, reach_m),
    )
    by_vessel: dict[int, list[PositionReport]] = defaultdict(list)
    for report in positions:
        by_vessel[report.mmsi].append(report)
    states = (
        state_at(reports, statics.get(mmsi, []), at, tracking)
        for mmsi, reports in sorted(by_vessel.items())
    )
    return [state for state in states if isinstance(state, VesselState)]
