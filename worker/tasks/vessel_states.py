"""The vessels around a camera at the moments of a batch's images, from stored reports.

Images of one while are near each other in time, so their reports are read once for all of them.
"""

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from operator import attrgetter
from typing import NamedTuple

from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.doubts import doubts_between
from app.ais.service import reports_between
from app.domain.ais import PositionReport, StaticReport
from app.domain.fusion_settings import FusionSettings, Preset
from app.domain.geodesy import Geodetic
from app.domain.plausibility import Doubt, receiver_clock_is_off
from app.domain.tracks import TrackMethod, TrackSettings, in_order, state_on
from app.domain.vessel_state import VesselState

# A vessel at anchor, or slow with class B, reports every three minutes: Hermite needs both sides.
_LONGEST_INTERVAL = timedelta(seconds=190)
_FIX_TIME = attrgetter("fix_time")
ByVessel = Mapping[int, list[PositionReport]]


class _Window(NamedTuple):
    """How far from an image's moment its reports may lie."""

    before: timedelta
    after: timedelta


def states_around(
    session: Session,
    site_id: int,
    camera_at: Geodetic,
    moments: Mapping[int, datetime],
    settings: FusionSettings,
) -> dict[int, list[VesselState]]:
    """Return by image id the states of all vessels heard within range of the camera, by MMSI.

    A vessel whose reports do not suffice for a state (no heading) is left out. `heading_dr`, the
    paper's, looks back only, as published; `hermite` uses what was heard after the image too. Each
    state says among its flags what is hard to believe of the reports it was made from. Vessels that
    only receivers with suspect clocks heard are withheld: shown, and matched with nothing.
    """
    own = TrackMethod.HEADING_DR if settings.preset is Preset.PAPER else TrackMethod.HERMITE
    method = settings.track_method or own
    oldest = timedelta(seconds=settings.maximum_report_age_s)
    window = _Window(oldest, timedelta(0))
    if method is TrackMethod.HERMITE:
        window = _Window(max(oldest, _LONGEST_INTERVAL), max(oldest, _LONGEST_INTERVAL))
    tracking = TrackSettings(
        method=method,
        max_age_s=settings.maximum_report_age_s,
        max_gap_s=2 * _LONGEST_INTERVAL.total_seconds(),
    )
    # A ship of 50 kn covers 1.5 km in a minute: what comes into range was heard outside it.
    reach_m = settings.maximum_range_m + 26 * settings.maximum_report_age_s
    area = Area.around(camera_at.lat_deg, camera_at.lon_deg, reach_m)
    states: dict[int, list[VesselState]] = {}
    for group in _groups(moments, window):
        start, end = moments[group[0]] - window.before, moments[group[-1]] + window.after
        heard = reports_between(session, site_id, start, end, area)
        tracks = _Tracks(heard.statics, window, tracking)
        credible = _by_vessel(heard.positions)
        withheld = [_by_vessel(heard.arrived), _by_vessel(heard.withheld)]
        doubts = {Doubt.RECEIVER_CLOCK} if receiver_clock_is_off(heard.positions) else set()
        of_group: dict[int, list[VesselState]] = {}
        for image_id in group:
            at = moments[image_id]
            known = [_doubted(state, doubts) for state in tracks.states(credible, at)]
            of_group[image_id] = known + tracks.withheld_states(withheld, at, but_for=known)
        states |= _with_doubts(session, site_id, of_group, start, end)
    return states


@dataclass(frozen=True, slots=True)
class _Tracks:
    """How states are made from the reports of a time window."""

    statics: Mapping[int, list[StaticReport]]
    window: _Window
    settings: TrackSettings

    def states(self, heard: ByVessel, at: datetime) -> list[VesselState]:
        """Return the states at a moment of all vessels heard, by MMSI."""
        states = []
        for mmsi, reports in heard.items():
            around = _around(reports, at, self.window)
            if around:
                state = state_on(around, self.statics.get(mmsi, []), at, self.settings)
                if isinstance(state, VesselState):
                    states.append(state)
        return states

    def withheld_states(
        self, heard: Iterable[ByVessel], at: datetime, but_for: Iterable[VesselState]
    ) -> list[VesselState]:
        """Return the states of vessels that only receivers with suspect clocks heard."""
        known = {state.identifier for state in but_for}
        found: dict[str, VesselState] = {}
        for reports in heard:
            for state in self.states(reports, at):
                found.setdefault(state.identifier, replace(state, is_withheld=True))
        return [state for identifier, state in found.items() if identifier not in known]


def _by_vessel(positions: Iterable[PositionReport]) -> ByVessel:
    """Return reports by MMSI, in its order, each vessel's oldest first."""
    by_vessel: dict[int, list[PositionReport]] = defaultdict(list)
    for report in positions:
        by_vessel[report.mmsi].append(report)
    return {mmsi: in_order(reports) for mmsi, reports in sorted(by_vessel.items())}


def _groups(moments: Mapping[int, datetime], window: _Window) -> Iterator[list[int]]:
    """Yield ids of images whose windows of reports overlap, oldest first."""
    group: list[int] = []
    for image_id in sorted(moments, key=lambda image_id: moments[image_id]):
        if group and moments[image_id] - moments[group[-1]] > window.before + window.after:
            yield group
            group = []
        group.append(image_id)
    if group:
        yield group


def _around(
    reports: Sequence[PositionReport], at: datetime, window: _Window
) -> Sequence[PositionReport]:
    """Return a vessel's reports, oldest first, that lie within an image's window."""
    first = bisect_left(reports, at - window.before, key=_FIX_TIME)
    return reports[first : bisect_right(reports, at + window.after, lo=first, key=_FIX_TIME)]


def _with_doubts(
    session: Session,
    site_id: int,
    states: Mapping[int, list[VesselState]],
    start: datetime,
    end: datetime,
) -> dict[int, list[VesselState]]:
    """Return the states of some images with what is hard to believe of the reports they used."""
    used = {report for of in states.values() for state in of for report in state.report_ids}
    vessels = {int(state.identifier) for of in states.values() for state in of}
    doubts = doubts_between(session, frozenset((site_id,)), used, vessels, start, end)
    return {
        image_id: [
            _doubted(state, {doubt for report in state.report_ids for doubt in doubts[report]})
            for state in of_image
        ]
        for image_id, of_image in states.items()
    }


def _doubted(state: VesselState, doubts: set[Doubt]) -> VesselState:
    """Return a state with some more doubts among its flags."""
    if not doubts:
        return state
    fresh = [str(doubt) for doubt in Doubt if doubt in doubts and doubt not in state.flags]
    return replace(state, flags=(*state.flags, *fresh)) if fresh else state
