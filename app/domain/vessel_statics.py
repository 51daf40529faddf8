"""What is known of a vessel's name and shape at a moment: the latest of each field.

Class A sends all statics in one message, class B in two halves, tables some of them in each row.
So each field is the latest one said at or before the moment; where a field was first said only
later, that is used, as a recording is often cut just before the vessel's next static message.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import NamedTuple

from app.domain.ais import StaticReport

# The largest distances of message 5; what is longer or wider says these.
_LONGEST_M = 511
_WIDEST_M = 63


@dataclass(frozen=True, slots=True)
class Hull:
    """Distances of the antenna to bow, stern, port and starboard, m: a real box, never empty.

    `is_centred` marks a vessel that did not say where its antenna stands (A = C = 0 with B and
    D known): the antenna is then put amidships, and is uncertain by half of each dimension.
    """

    to_bow_m: float
    to_stern_m: float
    to_port_m: float
    to_starboard_m: float
    is_centred: bool = False
    is_at_least: bool = False  # a distance is the largest that AIS can say, 511 m or 63 m


class KnownHull(NamedTuple):
    """A hull, when it was said and where that is stored.

    `is_later`: it was said only after the moment it is wanted for.
    """

    hull: Hull
    said_at: datetime
    is_later: bool
    report_id: int | None = None


@dataclass(frozen=True, slots=True)
class VesselStatics:
    """Name, kind and hull; None where nobody said. `is_later`: some field was said afterwards."""

    name: str | None = None
    callsign: str | None = None
    imo: int | None = None
    ship_type: int | None = None
    hull: Hull | None = None
    is_later: bool = False


def statics_at(statics: Sequence[StaticReport], at: datetime) -> VesselStatics:
    """Merge one vessel's static reports, in any order, into what was known at a moment."""
    before = [report for report in statics if report.received_at <= at]
    later = [report for report in statics if report.received_at > at]
    before.sort(key=lambda report: report.received_at, reverse=True)
    later.sort(key=lambda report: report.received_at)
    known, all_told = _merged(before), _merged([*before, *later])
    return replace(all_told, is_later=known != all_told)


def _merged(reports: Sequence[StaticReport]) -> VesselStatics:
    """Take each field from the first report that has it."""
    return VesselStatics(
        name=next((r.name for r in reports if r.name is not None), None),
        callsign=next((r.callsign for r in reports if r.callsign is not None), None),
        imo=next((r.imo for r in reports if r.imo is not None), None),
        ship_type=next((r.ship_type for r in reports if r.ship_type is not None), None),
        hull=next((hull for r in reports if (hull := hull_of(r)) is not None), None),
    )


def hull_at(statics: Sequence[StaticReport], at: datetime) -> KnownHull | None:
    """Return the latest hull said at or before a moment, else the first said after it.

    What vessel states need of `statics_at`, in one pass: a busy ship says it a hundred times a day.
    """
    latest: StaticReport | None = None
    following: StaticReport | None = None
    for report in reversed(statics):  # mostly oldest first: then the first to fit is the latest
        said_at = report.received_at
        if said_at > at:
            if (following is None or said_at <= following.received_at) and _has_hull(report):
                following = report
        elif (latest is None or said_at > latest.received_at) and _has_hull(report):
            latest = report
    used = latest or following
    hull = None if used is None else hull_of(used)
    if used is None or hull is None:
        return None
    return KnownHull(hull, used.received_at, used is following, used.report_id)


def hull_of(report: StaticReport) -> Hull | None:
    """Return the hull of a report; None if it has no length or no width."""
    to_bow_m, to_stern_m = report.to_bow_m, report.to_stern_m
    to_port_m, to_starboard_m = report.to_port_m, report.to_starboard_m
    if to_bow_m is None or to_stern_m is None or to_port_m is None or to_starboard_m is None:
        return None
    length_m, width_m = to_bow_m + to_stern_m, to_port_m + to_starboard_m
    if length_m <= 0 or width_m <= 0:
        return None
    at_least = (
        max(to_bow_m, to_stern_m) >= _LONGEST_M or max(to_port_m, to_starboard_m) >= _WIDEST_M
    )
    if to_bow_m == to_port_m == 0:
        half_length_m, half_width_m = length_m / 2, width_m / 2
        return Hull(half_length_m, half_length_m, half_width_m, half_width_m, True, at_least)
    return Hull(to_bow_m, to_stern_m, to_port_m, to_starboard_m, is_at_least=at_least)


def _has_hull(report: StaticReport) -> bool:
    """Whether `hull_of` finds one, without making it."""
    sides = (report.to_bow_m, report.to_stern_m, report.to_port_m, report.to_starboard_m)
    return None not in sides and any(sides[:2]) and any(sides[2:])
