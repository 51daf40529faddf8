"""Where a vessel was at the moment of an image, from reports before and after it.

Vessels report every 2 s to 3 min, the camera looks whenever it likes. Three methods bridge the
gap. `heading_dr` is the paper's: the latest report at or before the image, moved along the
heading. `cog_dr` moves it along the course instead, as wind and current move ships sideways.
`hermite` draws a cubic between the reports before and after the image with their speeds and
courses as tangents, and falls back to `cog_dr` where no later report exists. On five minutes of
real traffic the median error at an age of 10 to 30 s is about 4, 2 and 1 m.

A vessel that cannot be placed gets a reason instead, which the evaluation tables count.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from math import cos, hypot, radians, sin
from typing import NamedTuple

from app.domain.ais import PositionReport, StaticReport
from app.domain.local_metres import moved, offset_m
from app.domain.vessel_state import HeadingSource, VesselState
from app.domain.vessel_statics import VesselStatics, statics_at

MPS_PER_KN = 1852 / 3600
# One sigma of a heading, by where it came from.
REPORTED_SIGMA_DEG = 2.0
COURSE_SIGMA_DEG = 7.0
SLOW_COURSE_SIGMA_DEG = 15.0
STEADY_COURSE_KN = 5.0  # from here on the course is steady
HELD_SIGMA_DEG = 5.0


class TrackMethod(StrEnum):
    """How a position is carried to the moment of the image."""

    HEADING_DR = "heading_dr"
    COG_DR = "cog_dr"
    HERMITE = "hermite"


# How a place grows uncertain with the seconds that a method bridges, on real traffic.
_SIGMA_GROWTH_M_PER_S = {
    TrackMethod.HEADING_DR: 0.15,
    TrackMethod.COG_DR: 0.1,
    TrackMethod.HERMITE: 0.02,
}


class NoState(StrEnum):
    """Why a vessel has no state at the moment of an image."""

    NO_REPORT = "no_report"  # none at or before the image
    TOO_OLD = "too_old"
    NO_HEADING = "no_heading"
    NO_SPEED = "no_speed"  # a report before the image that cannot be carried forward
    NO_DIMENSIONS = "no_dimensions"  # nobody said how large the vessel is


@dataclass(frozen=True, slots=True)
class TrackSettings:
    """Parameters of a run; the defaults are those of preset `paper`."""

    method: TrackMethod = TrackMethod.HEADING_DR
    max_age_s: float = 60.0  # of the latest report, when there is none after the image
    max_gap_s: float = 360.0  # between the two reports that an image lies between
    min_course_kn: float = 3.0  # from here on a course may stand in for a heading
    max_still_kn: float = 1.0  # below, a vessel is nearly still and keeps its last heading
    max_held_s: float = 600.0  # for so long: vessels at anchor swing


class _Heading(NamedTuple):
    deg: float
    source: HeadingSource
    sigma_deg: float


class _Place(NamedTuple):
    """A place with the age still to be applied; `bridged_s` is how far its reports are away."""

    lat_deg: float
    lon_deg: float
    speed_kn: float
    age_s: float
    reports: tuple[PositionReport, ...]
    bridged_s: float


def state_at(
    reports: Sequence[PositionReport],
    statics: Sequence[StaticReport],
    at: datetime,
    settings: TrackSettings,
) -> VesselState | NoState:
    """Return the state of one vessel at a moment, or the reason why there is none.

    Args:
        reports: the vessel's positions around the moment, in any order; one MMSI only.
        statics: its static reports, in any order.
        at: the moment of the image, aware.
        settings: method and limits.

    Returns:
        A state whose place is the report's with the age still to be applied (`heading_dr`, the
        paper moves the vessel within the world frame), or the place at `at` with age 0.

    """
    if len({report.mmsi for report in reports}) > 1:
        raise ValueError("reports of several MMSI: a state is one vessel's, group them first")
    ordered = sorted(reports, key=lambda report: (report.fix_time, report.received_at))
    count_before = bisect_right(ordered, at, key=lambda report: report.fix_time)
    before, after = ordered[:count_before], ordered[count_before:]
    if not before:
        return NoState.NO_REPORT
    heading: _Heading | None
    place: _Place | NoState
    if settings.method is TrackMethod.HEADING_DR:
        place = _as_reported(before[-1], at, settings)
        heading = _reported_heading(before[-1])
    elif settings.method is TrackMethod.HERMITE and _spans(before, after, settings):
        place = _between(before[-1], after[0], at)
        heading = _heading_at(before, after, at, settings)
    else:
        place = _along_course(before[-1], at, settings)
        heading = _heading_at(before, (), at, settings)
    if isinstance(place, NoState):
        return place
    if heading is None:
        return NoState.NO_HEADING
    sigma_m = _bridging_sigma_m(place, settings.method)
    return _state(place, heading, statics_at(statics, at), sigma_m)


def _bridging_sigma_m(place: _Place, asked: TrackMethod) -> float:
    used = asked
    if asked is TrackMethod.HERMITE and len(place.reports) == 1:
        used = TrackMethod.COG_DR
    return _SIGMA_GROWTH_M_PER_S[used] * place.bridged_s


def _state(
    place: _Place, heading: _Heading, statics: VesselStatics, bridging_sigma_m: float
) -> VesselState | NoState:
    hull = statics.hull
    if hull is None:
        return NoState.NO_DIMENSIONS
    return VesselState(
        identifier=str(place.reports[0].mmsi),
        lat_deg=place.lat_deg,
        lon_deg=place.lon_deg,
        heading_deg=heading.deg,
        speed_kn=place.speed_kn,
        age_s=place.age_s,
        to_bow_m=hull.to_bow_m,
        to_stern_m=hull.to_stern_m,
        to_port_m=hull.to_port_m,
        to_starboard_m=hull.to_starboard_m,
        heading_source=heading.source,
        report_ids=tuple(r.report_id for r in place.reports if r.report_id is not None),
        position_sigma_m=hypot(
            max(report.position_sigma_m for report in place.reports),
            bridging_sigma_m,
            # An antenna put amidships may stand anywhere along the hull.
            (hull.to_bow_m + hull.to_stern_m) / 2 if hull.is_centred else 0.0,
        ),
        heading_sigma_deg=heading.sigma_deg,
    )


def _as_reported(report: PositionReport, at: datetime, settings: TrackSettings) -> _Place | NoState:
    age_s = (at - report.fix_time).total_seconds()
    if age_s > settings.max_age_s:
        return NoState.TOO_OLD
    if report.sog_kn is None:
        return NoState.NO_SPEED
    return _Place(report.lat_deg, report.lon_deg, report.sog_kn, age_s, (report,), age_s)


def _along_course(
    report: PositionReport, at: datetime, settings: TrackSettings
) -> _Place | NoState:
    place = _as_reported(report, at, settings)
    if isinstance(place, NoState):
        return place
    velocity = _velocity_mps(report)
    if velocity is None:
        return NoState.NO_SPEED
    east_m, north_m = (component * place.age_s for component in velocity)
    lat_deg, lon_deg = moved(report.lat_deg, report.lon_deg, east_m, north_m)
    return place._replace(lat_deg=lat_deg, lon_deg=lon_deg, age_s=0.0)


def _spans(
    before: Sequence[PositionReport], after: Sequence[PositionReport], settings: TrackSettings
) -> bool:
    """Whether the reports on both sides are near enough to be one movement."""
    if not after:
        return False
    return (after[0].fix_time - before[-1].fix_time).total_seconds() <= settings.max_gap_s


def _between(first: PositionReport, last: PositionReport, at: datetime) -> _Place:
    """Cubic Hermite between two reports, their velocities as tangents."""
    span_s = (last.fix_time - first.fix_time).total_seconds()
    chord = offset_m(first.lat_deg, first.lon_deg, last.lat_deg, last.lon_deg)
    mean_mps = (chord[0] / span_s, chord[1] / span_s)
    start_mps = _velocity_mps(first) or mean_mps
    end_mps = _velocity_mps(last) or mean_mps
    s = (at - first.fix_time).total_seconds() / span_s
    from_start = s * (1 - s) ** 2 * span_s
    from_end = s**2 * (s - 1) * span_s
    along = s**2 * (3 - 2 * s)
    east_m, north_m = (
        along * chord[axis] + from_start * start_mps[axis] + from_end * end_mps[axis]
        for axis in (0, 1)
    )
    lat_deg, lon_deg = moved(first.lat_deg, first.lon_deg, east_m, north_m)
    speeds = [report.sog_kn for report in (first, last)]
    known = [speed for speed in speeds if speed is not None]
    if len(known) == 2:
        speed_kn = known[0] + s * (known[1] - known[0])
    else:
        speed_kn = known[0] if known else 0.0
    nearest_s = min(s, 1 - s) * span_s
    return _Place(lat_deg, lon_deg, speed_kn, 0.0, (first, last), nearest_s)


def _velocity_mps(report: PositionReport) -> tuple[float, float] | None:
    """Velocity east and north, m/s; a vessel without way has no course and needs none."""
    if report.sog_kn is None:
        return None
    if report.cog_deg is None:
        return (0.0, 0.0) if report.sog_kn == 0 else None
    speed_mps = report.sog_kn * MPS_PER_KN
    course = radians(report.cog_deg)
    return (speed_mps * sin(course), speed_mps * cos(course))


def _reported_heading(report: PositionReport) -> _Heading | None:
    if report.heading_deg is None:
        return None
    return _Heading(report.heading_deg, HeadingSource.REPORTED, REPORTED_SIGMA_DEG)


def _heading_at(
    before: Sequence[PositionReport],
    after: Sequence[PositionReport],
    at: datetime,
    settings: TrackSettings,
) -> _Heading | None:
    """Heading by the best evidence: reported, else the course, else a still ship's last one."""
    latest = before[-1]
    if latest.heading_deg is not None:
        following = after[0].heading_deg if after else None
        if following is None:
            return _Heading(latest.heading_deg, HeadingSource.REPORTED, REPORTED_SIGMA_DEG)
        span_s = (after[0].fix_time - latest.fix_time).total_seconds()
        share = (at - latest.fix_time).total_seconds() / span_s
        turn_deg = (following - latest.heading_deg + 180) % 360 - 180
        heading_deg = (latest.heading_deg + share * turn_deg) % 360
        return _Heading(heading_deg, HeadingSource.REPORTED, REPORTED_SIGMA_DEG)
    speed_kn = latest.sog_kn
    if speed_kn is None:
        return None
    if speed_kn >= settings.min_course_kn:
        course = latest.cog_deg
        sigma_deg = COURSE_SIGMA_DEG if speed_kn >= STEADY_COURSE_KN else SLOW_COURSE_SIGMA_DEG
        return None if course is None else _Heading(course, HeadingSource.COURSE, sigma_deg)
    return _held_heading(before, at, settings)


def _held_heading(
    before: Sequence[PositionReport], at: datetime, settings: TrackSettings
) -> _Heading | None:
    for report in reversed(before):
        too_old = (at - report.fix_time).total_seconds() > settings.max_held_s
        if too_old or report.sog_kn is None or report.sog_kn > settings.max_still_kn:
            return None
        if report.heading_deg is not None:
            return _Heading(report.heading_deg, HeadingSource.HELD, HELD_SIGMA_DEG)
    return None
