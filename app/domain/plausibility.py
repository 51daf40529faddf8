"""What is hard to believe of AIS positions: flags on reports, never reasons to delete them.

AIS is unauthenticated and badly kept: two vessels share one MMSI, receivers' clocks are wrong,
positions jump across the world for one report. Whoever deletes such reports decides in silence;
here each keeps its place and carries its doubts, so that a pose made from it can be judged.

A report is compared with its vessel's reports around it. Nothing afloat covers more way in a time
than its own speeds allow: that much apart, two reports cannot both be true. If the reports beyond
the neighbours agree with this one, two vessels take turns under one MMSI; if not, it jumped.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from enum import StrEnum
from itertools import pairwise
from math import asin, cos, radians, sin, sqrt
from operator import attrgetter
from typing import NamedTuple, Protocol, TypeVar

from app.domain.ais import MPS_PER_KN, FixTimeSource

FASTEST_KN = 75.0  # the fastest ferries and patrol boats do not reach it
FARTHEST_M = 1_000_000.0  # beyond a receiver's horizon, even through ducts in the air
NEIGHBOURS = 2  # reports on each side that a verdict needs
_SLACK_KN = 8.0  # ships gather way between two reports
_SLACK_M = 100.0  # poor fixes, and antennas that are switched
_SLACK_S = 3.0  # moments known to a second or two
_SPEEDS_LAST_S = 120.0  # after longer a ship may have gone at any speed meanwhile
_FEWEST_VESSELS = 4  # that many wrong clocks at once are the receiver's
_PLACES_M = 1000.0  # nearer, it is one vessel with a poor receiver
_UNSURE_S = 25.0  # a doubtful moment may be nearly half a minute off
_CONFIRMABLE = (FixTimeSource.PROMPT, FixTimeSource.DOUBTFUL)
_SOURCE = attrgetter("fix_time_source")
_EARTH_M = 6_371_000.0
_M_PER_DEG = radians(_EARTH_M)
LONGEST_DELAY_S = 600.0  # from a receiver through servers to us; more is its clock
MOST_AHEAD_S = 60.0  # of arrival: no delay makes a report come before it was received


class Doubt(StrEnum):
    """Why a report is hard to believe."""

    JUMP = "jump"  # too far from the reports before and after it
    TWO_PLACES = "two_places"  # its MMSI reports from two places in turn
    IMPOSSIBLE_SPEED = "impossible_speed"  # it says that it is faster than anything afloat
    FAR_AWAY = "far_away"  # on another side of the world than the site, or at 0 N 0 E
    DOUBTFUL_TIME = "doubtful_time"  # its second contradicts its reception
    RECEIVER_CLOCK = "receiver_clock"  # so do those of most vessels heard then, or its arrival


class Fix(Protocol):
    """What of a report is needed: a stored row has it as well as a decoded message."""

    @property
    def mmsi(self) -> int: ...  # noqa: D102  as in PositionReport
    @property
    def fix_time(self) -> datetime: ...  # noqa: D102  as in PositionReport
    @property
    def lat_deg(self) -> float: ...  # noqa: D102  as in PositionReport
    @property
    def lon_deg(self) -> float: ...  # noqa: D102  as in PositionReport
    @property
    def sog_kn(self) -> float | None: ...  # noqa: D102  as in PositionReport
    @property
    def fix_time_source(self) -> str: ...  # noqa: D102  as in PositionReport


AnyFix = TypeVar("AnyFix", bound=Fix)
_Place = tuple[float, float]  # latitude and longitude, deg


class ReportedFix(NamedTuple):
    """A fix of stored reports, in the order of their columns."""

    mmsi: int
    fix_time: datetime
    lat_deg: float
    lon_deg: float
    sog_kn: float | None
    fix_time_source: str


def doubt_of_one(report: Fix) -> list[Doubt]:
    """Return what is doubtful of a report by itself."""
    found = []
    if report.sog_kn is not None and report.sog_kn > FASTEST_KN:
        found.append(Doubt.IMPOSSIBLE_SPEED)
    # A receiver without a fix often says 0 N 0 E instead of 91 N 181 E.
    if report.lat_deg == report.lon_deg == 0.0:
        found.append(Doubt.FAR_AWAY)
    if report.fix_time_source == FixTimeSource.DOUBTFUL:
        found.append(Doubt.DOUBTFUL_TIME)
    return found


def doubts(
    report: Fix,
    before: Sequence[Fix],
    after: Sequence[Fix],
    site: tuple[float, float] | None = None,
) -> list[Doubt]:
    """Return all that is doubtful of a report, given its vessel's reports around it.

    Args:
        report: the report to judge.
        before: up to `NEIGHBOURS` reports of the same MMSI before it, oldest first.
        after: the same after it.
        site: latitude and longitude, deg, of where it was heard; None if unknown.

    """
    found = doubt_of_one(report)
    if site is not None and not _is_near((report.lat_deg, report.lon_deg), site, FARTHEST_M):
        found.append(Doubt.FAR_AWAY)
    if not all(within_reach(report, other) for other in (*before[-1:], *after[:1])):
        around = [*before, report, *after]
        found += _parted(report, around, [within_reach(report, other) for other in around])
    return [doubt for doubt in Doubt if doubt in found] if found else []


def within_reach(first: Fix, second: Fix) -> bool:
    """Whether one vessel can have made both reports: near enough for their speeds and times."""
    ends = (first.lat_deg, first.lon_deg), (second.lat_deg, second.lon_deg)
    if _at_most_m(*ends) <= _SLACK_M:
        return True
    span_s = abs((second.fix_time - first.fix_time).total_seconds()) + _SLACK_S
    span_s += _UNSURE_S * sum(
        fix.fix_time_source == FixTimeSource.DOUBTFUL for fix in (first, second)
    )
    speed_kn = FASTEST_KN
    told_kn = [fix.sog_kn for fix in (first, second) if fix.sog_kn is not None]
    if told_kn and span_s < _SPEEDS_LAST_S:
        speed_kn = min(FASTEST_KN, max(told_kn) + _SLACK_KN)
    return _is_near(*ends, _SLACK_M + speed_kn * MPS_PER_KN * span_s)


def receiver_clock_is_off(reports: Iterable[Fix]) -> bool:
    """Whether most vessels heard in a while seem to have a wrong clock: then it is the receiver's.

    A vessel counts by its latest report whose moment a second in the message could confirm.
    """
    latest = {
        report.mmsi: report.fix_time_source == FixTimeSource.DOUBTFUL
        for report in reports
        if report.fix_time_source in _CONFIRMABLE
    }
    return len(latest) >= _FEWEST_VESSELS and sum(latest.values()) > len(latest) / 2


def is_contradicted(lag_s: float) -> bool:
    """Whether a receiver's time cannot be right, `lag_s` before a report came from it.

    Lines are delayed on their way by some minutes at most, and never come before they were heard. A
    replayed recording looks the same: only a person can tell it from a wrong clock.
    """
    return not -MOST_AHEAD_S <= lag_s <= LONGEST_DELAY_S


def clock_is_off(sources: Iterable[str]) -> bool:
    """Whether the seconds of most of a vessel's reports contradict their reception.

    `sources` are the reports' `fix_time_source`.

    Then its clock is wrong and the reception is right. A few such reports among others were delayed
    on their way, as 3 % are in any harbour: they say nothing against the vessel.
    """
    is_late = [source == FixTimeSource.DOUBTFUL for source in sources if source in _CONFIRMABLE]
    return sum(is_late) > len(is_late) / 2


def timely(reports: Sequence[AnyFix]) -> Sequence[AnyFix]:
    """Leave out those of a vessel's reports that came late: nobody knows of when their place is.

    Where its clock is off, all stay. In Danish traffic the next report lay 31 m (median) from where
    late ones led, and 7 m from where the reports before them did.
    """
    if FixTimeSource.DOUBTFUL not in map(_SOURCE, reports):
        return reports
    if clock_is_off(report.fix_time_source for report in reports):
        return reports
    return [report for report in reports if report.fix_time_source != FixTimeSource.DOUBTFUL]


def _parted(report: Fix, around: Sequence[Fix], here: Sequence[bool]) -> list[Doubt]:
    """Say why a report and a neighbour cannot both be true; `here`: who agrees with the report."""
    elsewhere = [fix for fix, agrees in zip(around, here, strict=True) if not agrees]
    alone = sum(here) == 1
    if len(elsewhere) == 1:
        # One against the others: the one jumped. One against one: either may have.
        return [Doubt.JUMP] if alone else []
    changes = sum(this != following for this, following in pairwise(here))
    agree = all(within_reach(elsewhere[0], other) for other in elsewhere[1:])
    own = (report.lat_deg, report.lon_deg)
    are_places = not any(_is_near(own, (fix.lat_deg, fix.lon_deg), _PLACES_M) for fix in elsewhere)
    takes_turns = changes > 1 and not alone and agree and are_places
    return [Doubt.TWO_PLACES if takes_turns else Doubt.JUMP]


def _is_near(one: _Place, other: _Place, reach_m: float) -> bool:
    """Whether two places are at most so far apart."""
    return _at_most_m(one, other) <= reach_m or _apart_m(one, other) <= reach_m


def _at_most_m(one: _Place, other: _Place) -> float:
    """Return what two places cannot be farther apart than, m: along a meridian and the equator."""
    return _M_PER_DEG * (abs(other[0] - one[0]) + abs(other[1] - one[1]))


def _apart_m(one: _Place, other: _Place) -> float:
    """Distance on a sphere (haversine), m: half a percent is enough here, the poles included."""
    lat, other_lat = radians(one[0]), radians(other[0])
    turn = radians(other[1] - one[1])
    chord = sin((other_lat - lat) / 2) ** 2 + cos(lat) * cos(other_lat) * sin(turn / 2) ** 2
    return 2 * _EARTH_M * asin(min(1.0, sqrt(chord)))
