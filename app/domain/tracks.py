"""Where a vessel was at the moment of an image, from reports before and after it.

Vessels report every 2 s to 3 min, the camera looks whenever it likes. Four methods bridge the gap.
`heading_dr` is the paper's: the latest report at or before the image, moved along the heading.
`cog_dr` moves it along the course instead, as wind and current move ships sideways; `ctrv_damped`
lets the course turn on for a while. `hermite` draws a cubic between the reports before and after
the image with their speeds and courses as tangents (over a longer silence a bend, if the ship
turned), and falls back to `cog_dr` where no later report exists. On five minutes of real traffic
the median error of reports 10 to 30 s old is about 4, 2, 2 and 1 m.

A vessel that cannot be placed gets a reason instead, which the evaluation tables count.
"""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from math import cos, radians, sin
from operator import attrgetter

from app.domain.ais import AUXILIARY_MMSI, MPS_PER_KN, PositionReport, StaticReport
from app.domain.plausibility import Doubt, doubt_of_one, timely
from app.domain.track_headings import Heading, heading_at, reported
from app.domain.track_places import Place, along_course, as_reported, between
from app.domain.vessel_state import HeadingSource, StateFlag, TrackMethod, VesselState
from app.domain.vessel_statics import Hull, KnownHull, hull_at

__all__ = [
    "MPS_PER_KN",
    "NoState",
    "TrackMethod",
    "TrackSettings",
    "in_order",
    "state_at",
    "state_on",
]


_FIX_TIME, _MMSI = attrgetter("fix_time"), attrgetter("mmsi")
_ORDER = attrgetter("fix_time", "received_at")


class NoState(StrEnum):
    """Why a vessel has no state at the moment of an image."""

    NO_REPORT = "no_report"  # none at or before the image
    TOO_OLD = "too_old"
    NO_HEADING = "no_heading"
    NO_SPEED = "no_speed"  # a report before the image that cannot be carried forward


@dataclass(frozen=True, slots=True)
class TrackSettings:
    """Parameters of a run; the defaults are those of preset `paper`."""

    method: TrackMethod = TrackMethod.HEADING_DR
    max_age_s: float = 60.0  # of the latest report, when there is none after the image
    max_gap_s: float = 360.0  # between the two reports that an image lies between


def state_at(
    reports: Sequence[PositionReport],
    statics: Sequence[StaticReport],
    at: datetime,
    settings: TrackSettings,
) -> VesselState | NoState:
    """Return the state of one vessel at a moment, or the reason why there is none.

    Args:
        reports: the vessel's positions around the moment, in any order; one MMSI only. Late ones
            among others in time count only where the others do not suffice.
        statics: its static reports, in any order.
        at: the moment of the image, aware.
        settings: method and limits.

    Returns:
        A state whose place is the report's with the age still to be applied (`heading_dr`, the
        paper moves the vessel within the world frame), or the place at `at` with age 0.

    """
    if len(set(map(_MMSI, reports))) > 1:
        raise ValueError("reports of several MMSI: a state is one vessel's, group them first")
    return state_on(in_order(reports), statics, at, settings)


def in_order(reports: Iterable[PositionReport]) -> list[PositionReport]:
    """Return a vessel's reports as `state_on` needs them, oldest first."""
    return sorted(reports, key=_ORDER)


def state_on(
    track: Sequence[PositionReport],
    statics: Sequence[StaticReport],
    at: datetime,
    settings: TrackSettings,
) -> VesselState | NoState:
    """Do what `state_at` does with reports that are known to be one vessel's and `in_order`."""
    kept = timely(track)
    found = _state_from(kept, statics, at, settings)
    if isinstance(found, NoState) and len(kept) < len(track):
        return _state_from(track, statics, at, settings)
    return found


def _state_from(
    track: Sequence[PositionReport],
    statics: Sequence[StaticReport],
    at: datetime,
    settings: TrackSettings,
) -> VesselState | NoState:
    count_before = bisect_right(track, at, key=_FIX_TIME)
    before, after = track[:count_before], track[count_before:]
    if not before:
        return NoState.NO_REPORT
    if settings.method is TrackMethod.HERMITE and _spans(before[-1], after, settings):
        place: Place | None = between(before, after[0], at)
    else:
        if (at - before[-1].fix_time).total_seconds() > settings.max_age_s:
            return NoState.TOO_OLD
        # What comes after the image is Hermite's alone; the others could run while it is taken.
        after, place = [], _carried(before, at, settings.method)
    if place is None:
        return NoState.NO_SPEED
    paper = settings.method is TrackMethod.HEADING_DR
    heading = reported(before[-1]) if paper else heading_at(before, after, at)
    if heading is None:
        return NoState.NO_HEADING
    return _state(place, heading, hull_at(statics, at))


def _spans(
    latest: PositionReport, after: Sequence[PositionReport], settings: TrackSettings
) -> bool:
    """Whether the reports on both sides are near enough to be one movement."""
    return bool(after) and (
        (after[0].fix_time - latest.fix_time).total_seconds() <= settings.max_gap_s
    )


def _carried(before: Sequence[PositionReport], at: datetime, asked: TrackMethod) -> Place | None:
    """Carry the latest report forward."""
    if asked is TrackMethod.HEADING_DR:
        return as_reported(before, at)
    return along_course(before, at, TrackMethod.COG_DR if asked is TrackMethod.HERMITE else asked)


def _state(place: Place, heading: Heading, known: KnownHull | None) -> VesselState:
    hull = known.hull if known else Hull(0.0, 0.0, 0.0, 0.0)
    held_on = heading.source is not HeadingSource.COURSE and len(place.reports) == 1
    heading_deg = (heading.deg + (place.turned_deg if held_on else 0.0)) % 360
    used = dict.fromkeys(
        report.report_id for report in (*place.reports, *heading.reports) if report.report_id
    )
    return VesselState(
        identifier=str(place.reports[0].mmsi),
        lat_deg=place.lat_deg,
        lon_deg=place.lon_deg,
        heading_deg=heading_deg,
        speed_kn=place.speed_kn,
        age_s=place.age_s,
        to_bow_m=hull.to_bow_m,
        to_stern_m=hull.to_stern_m,
        to_port_m=hull.to_port_m,
        to_starboard_m=hull.to_starboard_m,
        heading_source=heading.source,
        report_ids=tuple(identifier for identifier in used if identifier is not None),
        position_covariance_m2=_covariance_m2(place, heading_deg, hull),
        heading_sigma_deg=heading.sigma_deg,
        track_method=place.method,
        flags=_flags(place, heading, known),
        static_ids=(known.report_id,) if known and known.report_id else (),
    )


def _covariance_m2(place: Place, heading_deg: float, hull: Hull) -> tuple[float, float, float]:
    """Return east-east, east-north and north-north of the place."""
    parts = [(place.along_deg, place.along_sigma_m, place.cross_sigma_m)]
    if hull.is_centred:
        # An antenna put amidships may stand anywhere on the hull.
        half_length_m, half_width_m = hull.to_bow_m, hull.to_port_m
        parts.append((heading_deg, half_length_m, half_width_m))
    east_east = east_north = north_north = 0.0
    for along_deg, along_m, cross_m in parts:
        east, north = sin(radians(along_deg)), cos(radians(along_deg))
        along, cross = along_m**2, cross_m**2
        east_east += along * east**2 + cross * north**2
        north_north += along * north**2 + cross * east**2
        east_north += (along - cross) * east * north
    return east_east, east_north, north_north


def _flags(place: Place, heading: Heading, known: KnownHull | None) -> tuple[str, ...]:
    """Name what a person should know before trusting a state."""
    flags: list[StrEnum] = []
    if heading.source is not HeadingSource.REPORTED:
        flags.append(StateFlag.HEADING_NOT_REPORTED)
    if known is None:
        flags.append(StateFlag.NO_SIZE)
    else:
        if known.is_later:
            flags.append(StateFlag.LATER_SIZE)
        if known.hull.is_centred:
            flags.append(StateFlag.ANTENNA_UNKNOWN)
        if known.hull.is_at_least:
            flags.append(StateFlag.SIZE_AT_LEAST)
    if place.reports[0].mmsi in AUXILIARY_MMSI:
        flags.append(StateFlag.AUXILIARY_CRAFT)
    doubts = [doubt for report in place.reports for doubt in doubt_of_one(report)]
    if doubts:
        flags += [doubt for doubt in Doubt if doubt in doubts]
    return tuple(map(str, flags))
