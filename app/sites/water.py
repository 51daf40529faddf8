"""How high the water stands: a site's constant, or a gauge's series read between its readings.

A tide of three metres moves a vessel's box by dozens of pixels. Between two readings the level is
interpolated; where they lie more than a few hours apart (a tide turns in six) the series is silent
and the site's constant holds, which is said with the level.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise
from operator import itemgetter

from sqlalchemy.orm import Session

from app.sites import water_repository as repository
from app.tables.sites import Site
from app.tables.water import WaterLevelSource

LONGEST_GAP = timedelta(hours=3)
GAPS_SHOWN = 100
Reading = tuple[datetime, float]
_MEASURED_AT = itemgetter(0)


@dataclass(frozen=True, slots=True)
class Level:
    """Metres above the WGS84 ellipsoid, and where they come from."""

    level_m: float
    source: WaterLevelSource


@dataclass(frozen=True, slots=True)
class Series:
    """What is known of a site's series; gaps are longer than `LONGEST_GAP`."""

    readings: Sequence[Reading]
    gaps: Sequence[tuple[datetime, datetime]]


def level_at(session: Session, site: Site, moment: datetime) -> Level:
    """Return a site's water level at a moment."""
    return levels_at(session, site, [moment])[0]


def levels_at(session: Session, site: Site, moments: Sequence[datetime]) -> list[Level]:
    """Return a site's water levels at moments, from one look at its series."""
    if not moments:
        return []
    around = repository.readings_around(session, site.id, min(moments), max(moments))
    return [_level(site, around, moment) for moment in moments]


def _level(site: Site, readings: Sequence[Reading], moment: datetime) -> Level:
    """Return the level between the last reading until a moment and the first one from it on."""
    if not readings:
        return Level(site.water_level_m, WaterLevelSource.CONSTANT)
    earlier = bisect_right(readings, moment, key=_MEASURED_AT) - 1
    later = bisect_left(readings, moment, key=_MEASURED_AT)
    if earlier < 0 or later == len(readings):
        return Level(site.water_level_m, WaterLevelSource.GAP)
    before, after = readings[earlier], readings[later]
    if after[0] - before[0] > LONGEST_GAP:
        return Level(site.water_level_m, WaterLevelSource.GAP)
    return Level(_between(before, after, moment), WaterLevelSource.SERIES)


def _between(before: Reading, after: Reading, moment: datetime) -> float:
    span_s = (after[0] - before[0]).total_seconds()
    if span_s == 0:
        return before[1]
    share = (moment - before[0]).total_seconds() / span_s
    return before[1] + share * (after[1] - before[1])


def series_of(session: Session, site: Site) -> Series:
    """Return a site's series with its gaps."""
    readings = repository.readings(session, site.id)
    gaps = [
        (earlier[0], later[0])
        for earlier, later in pairwise(readings)
        if later[0] - earlier[0] > LONGEST_GAP
    ]
    return Series(readings, gaps)
