"""Carrying a vessel's reported place to the moment of an image, and how unsure that makes it.

Each method bridges the seconds between reports and image in its own way, and its errors grow in its
own way: along the course with the speed's error, across it with the course's, and both with how
unsteady the vessel was of late. The rates are those of real traffic (Danish freighters, pilot boats
and yachts of the Solent, each report held out and estimated from the others), so that a place says
honestly how far off it may be; `quaymark bench ais_states` checks them.
"""

from collections.abc import Sequence
from datetime import datetime
from math import atan2, cos, degrees, exp, hypot, radians, sin, sqrt
from typing import NamedTuple

from app.domain.ais import MPS_PER_KN, FixTimeSource, PositionReport
from app.domain.local_metres import m_per_deg, moved, offset_m
from app.domain.track_bends import Vector, round_a_bend
from app.domain.vessel_state import TrackMethod

# How well the moment of a fix is known, s: a ship's way in this time is along its course.
_TIME_SIGMA_S = {
    FixTimeSource.PROMPT: 0.3,
    FixTimeSource.RECEIVED: 2.0,
    FixTimeSource.DOUBTFUL: 3.0,
    FixTimeSource.STATED: 1.0,
}
# What a second of bridging adds to the sigmas along and across the course of a steady vessel, m,
# and how much of its own unsteadiness.
_GROWTH = {
    TrackMethod.HEADING_DR: (0.08, 0.28, 0.7),
    TrackMethod.COG_DR: (0.08, 0.12, 0.7),
    TrackMethod.CTRV_DAMPED: (0.08, 0.12, 0.7),
    TrackMethod.HERMITE: (0.12, 0.08, 0.5),
}
_UNKNOWN_UNSTEADINESS_MPS = 0.4
# An unsteady vessel changes its mind: within so long its unsteadiness counts twice. Without this,
# 45 % of pilot boats' errors beyond a minute lay in the ellipse of 68 %. Not so between reports.
_MIND_CHANGES_S = 90.0
# Reports so old tell how far off the vessel's course and speed led.
_UNSTEADY_S = (10.0, 90.0)
_UNSTEADY_REPORTS = 8
_BEND_S = 90.0  # between two reports so far apart a ship may well turn and be steady again
_DAMPING_S = 20.0  # a turn dies away within so long
_LONGEST_TURN_S = 30.0  # reports further apart do not tell how fast a ship turns now
_FASTEST_TURN_DEG_S = 6.0
_TURNING_KN = 1.0  # below, headings wander without the ship's way following them
_STEPS = 8


class Place(NamedTuple):
    """A place with the age still to be applied, and its sigmas along and across `along_deg`."""

    lat_deg: float
    lon_deg: float
    speed_kn: float
    age_s: float
    reports: tuple[PositionReport, ...]
    method: TrackMethod
    along_deg: float
    along_sigma_m: float
    cross_sigma_m: float
    turned_deg: float = 0.0  # how far the course turned while bridging


def as_reported(before: Sequence[PositionReport], at: datetime) -> Place | None:
    """Leave the latest report where it is, its age to be applied along the heading (the paper)."""
    report = before[-1]
    if report.sog_kn is None:
        return None
    age_s = (at - report.fix_time).total_seconds()
    along_deg = report.heading_deg if report.heading_deg is not None else report.cog_deg or 0.0
    return Place(
        report.lat_deg,
        report.lon_deg,
        report.sog_kn,
        age_s,
        (report,),
        TrackMethod.HEADING_DR,
        along_deg,
        *_sigmas_m(TrackMethod.HEADING_DR, before, (report,), report.sog_kn, age_s),
    )


def along_course(
    before: Sequence[PositionReport], at: datetime, method: TrackMethod
) -> Place | None:
    """Move the latest report along its course (`cog_dr`), or along its turn (`ctrv_damped`)."""
    report = before[-1]
    velocity = velocity_mps(report)
    if velocity is None or report.sog_kn is None:
        return None
    age_s = (at - report.fix_time).total_seconds()
    rate_deg_s = turn_rate_deg_s(before) if method is TrackMethod.CTRV_DAMPED else 0.0
    turned_deg = rate_deg_s * _DAMPING_S * (1 - exp(-age_s / _DAMPING_S))
    if rate_deg_s:
        east_m, north_m = _way_in_a_turn(velocity, rate_deg_s, age_s)
    else:
        east_m, north_m = velocity[0] * age_s, velocity[1] * age_s
    lat_deg, lon_deg = moved(report.lat_deg, report.lon_deg, east_m, north_m)
    return Place(
        lat_deg,
        lon_deg,
        report.sog_kn,
        0.0,
        (report,),
        method,
        (report.cog_deg or 0.0) + turned_deg / 2,
        *_sigmas_m(method, before, (report,), report.sog_kn, age_s),
        turned_deg,
    )


def between(before: Sequence[PositionReport], last: PositionReport, at: datetime) -> Place:
    """Cubic Hermite between the latest report before and the next, their velocities as tangents.

    Over a longer silence a ship that turned goes round a bend instead, if its speeds allow.
    """
    first = before[-1]
    span_s = (last.fix_time - first.fix_time).total_seconds()
    since_s = (at - first.fix_time).total_seconds()
    s = since_s / span_s
    chord = offset_m(first.lat_deg, first.lon_deg, last.lat_deg, last.lon_deg)
    mean_mps = (chord[0] / span_s, chord[1] / span_s)
    start_mps, end_mps = velocity_mps(first), velocity_mps(last)
    bend = None
    if span_s >= _BEND_S and start_mps and end_mps:
        bend = round_a_bend(chord, start_mps, end_mps, span_s, since_s)
    east_m, north_m = bend or _on_a_cubic(
        chord, start_mps or mean_mps, end_mps or mean_mps, span_s, s
    )
    lat_deg, lon_deg = moved(first.lat_deg, first.lon_deg, east_m, north_m)
    known = [report.sog_kn for report in (first, last) if report.sog_kn is not None]
    if len(known) == 2:
        speed_kn = known[0] + s * (known[1] - known[0])
    else:
        speed_kn = known[0] if known else 0.0
    return Place(
        lat_deg,
        lon_deg,
        speed_kn,
        0.0,
        (first, last),
        TrackMethod.HERMITE,
        degrees(atan2(*mean_mps)),
        *_sigmas_m(TrackMethod.HERMITE, before, (first, last), speed_kn, s * (1 - s) * span_s),
    )


def _on_a_cubic(
    chord_m: Vector, start_mps: Vector, end_mps: Vector, span_s: float, s: float
) -> Vector:
    """Return the place at the share `s` of the time, m from the first."""
    from_start = s * (1 - s) ** 2 * span_s
    from_end = s**2 * (s - 1) * span_s
    along = s**2 * (3 - 2 * s)
    east_m, north_m = (
        along * chord_m[axis] + from_start * start_mps[axis] + from_end * end_mps[axis]
        for axis in (0, 1)
    )
    return east_m, north_m


def velocity_mps(report: PositionReport) -> tuple[float, float] | None:
    """Velocity east and north, m/s; a vessel without way has no course and needs none."""
    if report.sog_kn is None:
        return None
    if report.cog_deg is None:
        return (0.0, 0.0) if report.sog_kn == 0 else None
    speed_mps = report.sog_kn * MPS_PER_KN
    course = radians(report.cog_deg)
    return (speed_mps * sin(course), speed_mps * cos(course))


def turn_rate_deg_s(before: Sequence[PositionReport]) -> float:
    """Return how fast a ship turns clockwise by its last two headings, else courses; else 0.

    Raw rate-of-turn fields never beat holding the heading on real traffic, so none is read.
    """
    if len(before) < 2:
        return 0.0
    previous, latest = before[-2], before[-1]
    span_s = (latest.fix_time - previous.fix_time).total_seconds()
    if not 0 < span_s <= _LONGEST_TURN_S or (latest.sog_kn or 0.0) < _TURNING_KN:
        return 0.0
    for earlier, later in (
        (previous.heading_deg, latest.heading_deg),
        (previous.cog_deg, latest.cog_deg),
    ):
        if earlier is not None and later is not None:
            rate = turn_deg(earlier, later) / span_s
            return max(-_FASTEST_TURN_DEG_S, min(_FASTEST_TURN_DEG_S, rate))
    return 0.0


def turn_deg(from_deg: float, to_deg: float) -> float:
    """Return the turn from one direction to another, the short way, positive to starboard."""
    return (to_deg - from_deg + 180) % 360 - 180


def _way_in_a_turn(
    velocity: tuple[float, float], rate_deg_s: float, age_s: float
) -> tuple[float, float]:
    """Metres east and north on a course that turns on, ever slower (Simpson's rule)."""
    east_mps, north_mps = velocity
    swept = radians(rate_deg_s) * _DAMPING_S
    east_m = north_m = 0.0
    for step in range(_STEPS + 1):
        turned = swept * (1 - exp(-age_s * step / _STEPS / _DAMPING_S))
        weight = (1 if step in {0, _STEPS} else 2 + 2 * (step % 2)) * age_s / _STEPS / 3
        east_m += weight * (east_mps * cos(turned) + north_mps * sin(turned))
        north_m += weight * (north_mps * cos(turned) - east_mps * sin(turned))
    return east_m, north_m


def _sigmas_m(
    method: TrackMethod,
    before: Sequence[PositionReport],
    used: tuple[PositionReport, ...],
    speed_kn: float,
    bridged_s: float,
) -> tuple[float, float]:
    """One sigma along and across the course: the fixes' own, their moments', the bridging's."""
    along_mps, cross_mps, share = _GROWTH[method]
    own_mps = share * _unsteadiness_mps(before)
    if method is not TrackMethod.HERMITE:
        own_mps *= 1 + bridged_s / _MIND_CHANGES_S
    fix_m = max(report.position_sigma_m for report in used)
    time_s = max(_TIME_SIGMA_S[report.fix_time_source] for report in used)
    return (
        hypot(fix_m, speed_kn * MPS_PER_KN * time_s, hypot(along_mps, own_mps) * bridged_s),
        hypot(fix_m, hypot(cross_mps, own_mps) * bridged_s),
    )


def _unsteadiness_mps(before: Sequence[PositionReport]) -> float:
    """Return how fast a vessel lately went away from where its course and speed led, m/s.

    A pilot boat that turns and stops is far harder to foretell than a freighter at sea.
    """
    latest, squares = before[-1], []
    m_per_deg_east, m_per_deg_north = m_per_deg(latest.lat_deg)
    for report in before[-2 : -2 - _UNSTEADY_REPORTS : -1]:
        span_s = (latest.fix_time - report.fix_time).total_seconds()
        if span_s > _UNSTEADY_S[1]:
            break
        velocity = velocity_mps(report) if span_s >= _UNSTEADY_S[0] else None
        if velocity is not None:
            east_m = turn_deg(report.lon_deg, latest.lon_deg) * m_per_deg_east
            north_m = (latest.lat_deg - report.lat_deg) * m_per_deg_north
            off_m = hypot(velocity[0] * span_s - east_m, velocity[1] * span_s - north_m)
            squares.append((off_m / span_s) ** 2)
    return sqrt(sum(squares) / len(squares)) if squares else _UNKNOWN_UNSTEADINESS_MPS
