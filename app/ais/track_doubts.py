"""What is hard to believe of a vessel in a stretch of time, found without judging every report.

A few late reports are no doubt of a vessel: every receiver has them. Only a clock that contradicts
most of its reports is.

Nearly all steps of nearly all tracks are plausible at a glance: shorter than the fastest craft
could have made them. Only the reports around the others are judged by the domain's rules.
"""

import math
from collections.abc import Sequence
from datetime import datetime, timedelta
from itertools import pairwise

from app.ais.thinning import METRES_PER_DEG, Fix
from app.domain.ais import MPS_PER_KN
from app.domain.plausibility import FASTEST_KN, NEIGHBOURS, Doubt, ReportedFix, clock_is_off, doubts

_FEWEST = 3  # of one or two reports, late ones may well be the most
_SLOWLY_DEG_S = FASTEST_KN * MPS_PER_KN / METRES_PER_DEG


def doubts_of(mmsi: int, fixes: Sequence[Fix], start: datetime) -> list[Doubt]:
    """Return what is doubtful of a vessel's fixes, oldest first; `start` is their second 0."""
    around: set[int] = set()
    for index, (first, second) in enumerate(pairwise(fixes)):
        if _is_odd(first, second):
            around.update(range(index - NEIGHBOURS, index + 2 + NEIGHBOURS))
    if fixes and _too_fast(fixes[0]):
        around.add(0)
    reports = (
        {
            index: _reported(mmsi, fixes[index], start)
            for index in range(len(fixes))
            if {*range(index - NEIGHBOURS, index + NEIGHBOURS + 1)} & around
        }
        if around
        else {}
    )
    found: set[Doubt] = set()
    for index in around & reports.keys():
        before = [reports[at] for at in range(index - NEIGHBOURS, index) if at in reports]
        after = [reports[at] for at in range(index + 1, index + 1 + NEIGHBOURS) if at in reports]
        found.update(doubts(reports[index], before, after))
    found.discard(Doubt.DOUBTFUL_TIME)
    if len(fixes) >= _FEWEST and clock_is_off(fix.source for fix in fixes):
        found.add(Doubt.DOUBTFUL_TIME)
    return [doubt for doubt in Doubt if doubt in found]


def _is_odd(first: Fix, second: Fix) -> bool:
    """Whether a step is longer than the fastest craft makes, or a speed higher than it has."""
    north = second.lat_deg - first.lat_deg
    east = second.lon_deg - first.lon_deg
    if abs(north) + abs(east) < _SLOWLY_DEG_S * (second.time_s - first.time_s):
        return _too_fast(second)
    east *= math.cos(math.radians(first.lat_deg))
    way_m = math.hypot(north, east) * METRES_PER_DEG
    return way_m > FASTEST_KN * MPS_PER_KN * (second.time_s - first.time_s) or _too_fast(second)


def _too_fast(fix: Fix) -> bool:
    return fix.sog_kn is not None and fix.sog_kn > FASTEST_KN


def _reported(mmsi: int, fix: Fix, start: datetime) -> ReportedFix:
    moment = start + timedelta(seconds=fix.time_s)
    return ReportedFix(mmsi, moment, fix.lat_deg, fix.lon_deg, fix.sog_kn, fix.source)
