"""The vessels around a camera at the moment of one image, from stored reports."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.doubts import doubts_of
from app.ais.service import reports_between
from app.domain.ais import PositionReport
from app.domain.fusion_settings import FusionSettings, Preset
from app.domain.geodesy import Geodetic
from app.domain.plausibility import Doubt, receiver_clock_is_off
from app.domain.tracks import TrackMethod, TrackSettings, state_at
from app.domain.vessel_state import VesselState

# A vessel at anchor, or slow with class B, reports every three minutes: Hermite needs both sides.
_LONGEST_INTERVAL_S = 190.0


def states_around(
    session: Session, site_id: int, camera_at: Geodetic, at: datetime, settings: FusionSettings
) -> list[VesselState]:
    """Return the states of all vessels heard lately within range of the camera, by MMSI.

    A vessel whose reports do not suffice for a state (no heading) is left out. `heading_dr`, the
    paper's, looks back only, as published; others use what was heard after the image too.
    """
    is_paper = settings.preset is Preset.PAPER
    own = TrackMethod.HEADING_DR if is_paper else TrackMethod.HERMITE
    method = settings.track_method or own
    age_s = settings.maximum_report_age_s
    tracking = TrackSettings(method=method, max_age_s=age_s, max_gap_s=2 * _LONGEST_INTERVAL_S)
    around_s = max(age_s, _LONGEST_INTERVAL_S) if method is TrackMethod.HERMITE else 0.0
    # A ship of 50 kn covers 1.5 km in a minute: what comes into range was heard outside it.
    reach_m = settings.maximum_range_m + 26 * age_s
    positions, statics = reports_between(
        session,
        site_id,
        at - timedelta(seconds=max(age_s, around_s)),
        at + timedelta(seconds=around_s),
        Area.around(camera_at.lat_deg, camera_at.lon_deg, reach_m),
    )
    by_vessel: dict[int, list[PositionReport]] = defaultdict(list)
    for report in positions:
        by_vessel[report.mmsi].append(report)
    states = (
        state_at(reports, statics.get(mmsi, []), at, tracking)
        for mmsi, reports in sorted(by_vessel.items())
    )
    doubts = {Doubt.RECEIVER_CLOCK} if receiver_clock_is_off(positions) else set()
    return [_doubted(state, doubts) for state in states if isinstance(state, VesselState)]


def with_doubts(
    session: Session, site_id: int, states: Mapping[int, list[VesselState]]
) -> dict[int, list[VesselState]]:
    """Return the states of some images with what is hard to believe of the reports they used."""
    used = {report for of in states.values() for state in of for report in state.report_ids}
    doubts = doubts_of(session, frozenset((site_id,)), used)
    return {
        image_id: [
            _doubted(state, {doubt for report in state.report_ids for doubt in doubts[report]})
            for state in of_image
        ]
        for image_id, of_image in states.items()
    }


def _doubted(state: VesselState, doubts: set[Doubt]) -> VesselState:
    """Return a state with some more doubts among its flags."""
    fresh = [str(doubt) for doubt in Doubt if doubt in doubts and doubt not in state.flags]
    return replace(state, flags=(*state.flags, *fresh)) if fresh else state
