"""Which way a vessel heads at a moment, by the best evidence there is, and how unsure that is.

One class A report in eight and nearly all of class B carry no heading. A ship that makes way heads
about where it goes; one that creeps heads about where its places lead; one that lies still heads
where it last did. Which of these was used is recorded with the state. With none of them a vessel
has no heading, and nothing is made up.
"""

from collections.abc import Sequence
from datetime import datetime
from math import atan2, degrees, hypot
from typing import NamedTuple

from app.domain.ais import PositionReport
from app.domain.local_metres import offset_m
from app.domain.track_places import turn_deg
from app.domain.vessel_state import HeadingSource

# One sigma of a heading, by where it came from.
REPORTED_SIGMA_DEG = 1.2  # compasses, and whole degrees
COURSE_SIGMA_DEG = 7.0
SLOW_COURSE_SIGMA_DEG = 15.0
STEADY_COURSE_KN = 5.0  # from here on the course is steady
HELD_SIGMA_DEG = 5.0
MIN_COURSE_KN = 3.0  # from here on a course may stand in for a heading
MAX_STILL_KN = 1.0  # below, a vessel is nearly still and keeps its last heading
MAX_HELD_S = 600.0  # for so long: vessels at anchor swing
_TRACK_S = 90.0  # places as far away as this from the image tell where a creeping vessel heads
_SHORTEST_TRACK_M = 15.0
_FIX_NOISE_M = 3.0  # from fix to fix; most of a receiver's error is the same in all
_TRACK_SIGMA_DEG = 15.0  # wind and current move a creeping vessel sideways


class Heading(NamedTuple):
    """A heading with its source, its sigma and the reports that it was taken from."""

    deg: float
    source: HeadingSource
    sigma_deg: float
    reports: tuple[PositionReport, ...]


def reported(report: PositionReport) -> Heading | None:
    """Return the heading a report carries."""
    if report.heading_deg is None:
        return None
    return Heading(report.heading_deg, HeadingSource.REPORTED, REPORTED_SIGMA_DEG, (report,))


def heading_at(
    before: Sequence[PositionReport], after: Sequence[PositionReport], at: datetime
) -> Heading | None:
    """Return the heading from reports before (one at least) and after a moment, oldest first."""
    latest = before[-1]
    following = after[0] if after else None
    if latest.heading_deg is not None:
        return _turning(latest, following, at, HeadingSource.REPORTED, REPORTED_SIGMA_DEG)
    if latest.sog_kn is None:
        return None
    if latest.sog_kn >= MIN_COURSE_KN and latest.cog_deg is not None:
        is_steady = latest.sog_kn >= STEADY_COURSE_KN
        sigma_deg = COURSE_SIGMA_DEG if is_steady else SLOW_COURSE_SIGMA_DEG
        makes_way = following is not None and (following.sog_kn or 0.0) >= MIN_COURSE_KN
        return _turning(
            latest, following if makes_way else None, at, HeadingSource.COURSE, sigma_deg
        )
    if latest.sog_kn > MAX_STILL_KN:
        return _of_track(before, after, at)
    return _held(before, after, at)


def _turning(
    latest: PositionReport,
    following: PositionReport | None,
    at: datetime,
    source: HeadingSource,
    sigma_deg: float,
) -> Heading | None:
    """Turn from the direction of one report to that of the next, the short way."""
    first = _direction(latest, source)
    last = None if following is None else _direction(following, source)
    if first is None:
        return None
    if following is None or last is None:
        return Heading(first, source, sigma_deg, (latest,))
    span_s = (following.fix_time - latest.fix_time).total_seconds()
    share = (at - latest.fix_time).total_seconds() / span_s
    deg = (first + share * turn_deg(first, last)) % 360
    return Heading(deg, source, sigma_deg, (latest, following))


def _direction(report: PositionReport, source: HeadingSource) -> float | None:
    return report.heading_deg if source is HeadingSource.REPORTED else report.cog_deg


def _of_track(
    before: Sequence[PositionReport], after: Sequence[PositionReport], at: datetime
) -> Heading | None:
    """Head from the first to the last place around the moment, if these lie apart enough."""
    near = [
        report
        for report in (*before, *after)
        if abs((report.fix_time - at).total_seconds()) <= _TRACK_S
    ]
    if len(near) < 2:
        return None
    first, last = near[0], near[-1]
    east_m, north_m = offset_m(first.lat_deg, first.lon_deg, last.lat_deg, last.lon_deg)
    way_m = hypot(east_m, north_m)
    if way_m < _SHORTEST_TRACK_M:
        return None
    sigma_deg = hypot(_TRACK_SIGMA_DEG, degrees(_FIX_NOISE_M / way_m))
    deg = degrees(atan2(east_m, north_m)) % 360
    return Heading(deg, HeadingSource.TRACK, sigma_deg, (first, last))


def _held(
    before: Sequence[PositionReport], after: Sequence[PositionReport], at: datetime
) -> Heading | None:
    """Return the nearest heading of a time through which the vessel hardly moved."""
    for side in (reversed(before), after):
        for report in side:
            is_far = abs((at - report.fix_time).total_seconds()) > MAX_HELD_S
            if is_far or report.sog_kn is None or report.sog_kn > MAX_STILL_KN:
                break
            if report.heading_deg is not None:
                return Heading(report.heading_deg, HeadingSource.HELD, HELD_SIGMA_DEG, (report,))
    return None
