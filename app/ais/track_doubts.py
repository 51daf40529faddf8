"""What is hard to believe of a vessel in a stretch of time, found without judging every report.

A few late reports are no doubt of a vessel: every receiver has them. Only a clock that contradicts
most of its reports is.

Nearly all steps of nearly all tracks are plausible at a glance: shorter than the fastest craft
could have made them. All steps are glanced at together, and only the reports around the others are
judged by the domain's rules.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta

import numpy as np

from app.ais.moving_fixes import MovingFixes
from app.ais.thinning import METRES_PER_DEG
from app.domain.ais import MPS_PER_KN, FixTimeSource
from app.domain.ais_bulk import SOURCES
from app.domain.arrays import BoolArray
from app.domain.plausibility import FASTEST_KN, NEIGHBOURS, Doubt, ReportedFix, clock_is_off, doubts

_FEWEST = 3  # of one or two reports, late ones may well be the most
_LATE = SOURCES.index(FixTimeSource.DOUBTFUL)


def doubts_of(fixes: MovingFixes, start: datetime) -> dict[int, list[Doubt]]:
    """Return what is doubtful of vessels, for those of whom anything is; `start` is second 0."""
    is_odd = _odd_steps(fixes)
    is_worth_a_look = is_odd | (fixes.source == _LATE)
    found = {}
    for own in fixes.slices():
        if is_worth_a_look[own].any():
            reports = _reports(fixes, own, start)
            doubtful = _judged(reports, np.flatnonzero(is_odd[own]).tolist())
            doubtful.discard(Doubt.DOUBTFUL_TIME)
            if len(reports) >= _FEWEST and clock_is_off(fix.fix_time_source for fix in reports):
                doubtful.add(Doubt.DOUBTFUL_TIME)
            if doubtful:
                found[int(fixes.mmsi[own.start])] = [each for each in Doubt if each in doubtful]
    return found


def _odd_steps(fixes: MovingFixes) -> BoolArray:
    """Return which fixes are further from the one before than the fastest craft goes, or faster."""
    north = np.diff(fixes.lat_deg)
    east = np.diff(fixes.lon_deg) * np.cos(np.radians(fixes.lat_deg[:-1]))
    way_m = np.hypot(north, east) * METRES_PER_DEG
    is_odd = fixes.sog_kn > FASTEST_KN  # never where it is unknown
    is_same = np.diff(fixes.mmsi) == 0
    is_odd[1:] |= is_same & (way_m > FASTEST_KN * MPS_PER_KN * np.diff(fixes.time_s))
    return is_odd


def _judged(reports: Sequence[ReportedFix], odd: Sequence[int]) -> set[Doubt]:
    """Judge the reports around odd steps of a vessel."""
    around = {at for step in odd for at in range(step - 1 - NEIGHBOURS, step + 1 + NEIGHBOURS)}
    found: set[Doubt] = set()
    for at in around & set(range(len(reports))):
        before = reports[max(0, at - NEIGHBOURS) : at]
        found.update(doubts(reports[at], before, reports[at + 1 : at + 1 + NEIGHBOURS]))
    return found


def _reports(fixes: MovingFixes, own: slice, start: datetime) -> list[ReportedFix]:
    mmsi = int(fixes.mmsi[own.start])
    columns = (fixes.time_s, fixes.lat_deg, fixes.lon_deg, fixes.sog_kn, fixes.source)
    return [
        ReportedFix(
            mmsi,
            start + timedelta(seconds=time_s),
            lat_deg,
            lon_deg,
            None if sog_kn != sog_kn else sog_kn,  # noqa: PLR0124  NaN alone is not itself
            SOURCES[source],
        )
        for time_s, lat_deg, lon_deg, sog_kn, source in zip(
            *(column[own].tolist() for column in columns), strict=True
        )
    ]
