"""The tracks of a stretch of time, small enough to send and to draw whatever the traffic.

Two bounds hold: how many positions are read, and how many points are sent. Where the second would
be exceeded, all tracks are thinned more until it is not; where the first is, the answer says until
when it reaches.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
from sqlalchemy.orm import Session

from app.ais import map_repository
from app.ais.area import Area
from app.ais.moving_fixes import MovingFixes
from app.ais.report_repository import Readable
from app.ais.thinning import thinned
from app.ais.track import LONGEST_SILENCE
from app.ais.track_doubts import doubts_of
from app.db import now
from app.domain.arrays import BoolArray
from app.domain.plausibility import Doubt
from app.errors import Invalid
from app.tables.ais import Vessel

LONGEST_STRETCH = timedelta(hours=6)
MOST_READ = 400_000
MOST_SENT = 60_000
MOST_NEW = 20_000
FOLLOWED = timedelta(hours=1)
AHEAD = timedelta(seconds=30)


@dataclass(frozen=True, slots=True)
class Stretch:
    """All tracks between two moments; `read_until` is earlier than `end` where it was too much.

    `fixes` are the thinned tracks, seconds since `start`. `vessels` has what is known of vessels,
    `doubts` what is not plausible of them, if anything.
    """

    start: datetime
    end: datetime
    read_until: datetime
    tolerance_m: float
    fixes: MovingFixes
    vessels: Mapping[int, Vessel]
    doubts: Mapping[int, list[Doubt]]


def stretch(
    session: Session,
    readable: Readable,
    start: datetime,
    end: datetime,
    area: Area | None,
    tolerance_m: float,
    most: int = MOST_SENT,
) -> Stretch:
    """Return the tracks of a stretch of time, thinned to a tolerance or as much as it needs.

    Raises Invalid for a stretch that is empty or longer than six hours.
    """
    if not timedelta(0) < end - start <= LONGEST_STRETCH:
        raise Invalid.field("to", "must come after `from`, by at most six hours")
    rows = map_repository.moving(session, readable, start, end, area, MOST_READ)
    read = MovingFixes.of(rows, start.timestamp())
    is_cut = len(read) >= MOST_READ
    fixes = read.once()
    kept, tolerance_m = _fitted(fixes, tolerance_m, most)
    mmsis = np.unique(kept.mmsi).tolist()
    return Stretch(
        start=start,
        end=end,
        read_until=start + timedelta(seconds=float(read.time_s.max())) if is_cut else end,
        tolerance_m=tolerance_m,
        fixes=kept,
        vessels=map_repository.vessels(session, mmsis),
        doubts=doubts_of(fixes, start),
    )


def news(
    session: Session, readable: Readable, after: int, area: Area | None
) -> tuple[Stretch, int, bool]:
    """Return what live feeds brought after a position's number, each point of it.

    Also the number to ask with next, and whether it was too much to follow: then the tracks of now
    have to be asked for again. What a receiver's wrong clock dates far from now is not told.
    """
    moment = now()
    start = (moment - FOLLOWED).replace(microsecond=0)
    rows, last, is_cut = map_repository.arrived_after(session, readable, after, MOST_NEW)
    fixes = MovingFixes.of(rows, start.timestamp()).once()
    is_recent = (fixes.time_s >= 0) & (fixes.time_s <= (FOLLOWED + AHEAD).total_seconds())
    fixes = fixes.taken(is_recent if area is None else is_recent & _are_in(area, fixes))
    vessels = map_repository.vessels(session, np.unique(fixes.mmsi).tolist())
    return Stretch(start, moment, moment, 0.0, fixes, vessels, {}), last, is_cut


def _are_in(area: Area, fixes: MovingFixes) -> BoolArray:
    """Return which fixes lie in an area."""
    is_east, is_west = fixes.lon_deg >= area.west_deg, fixes.lon_deg <= area.east_deg
    is_across = is_east | is_west if area.crosses_antimeridian else is_east & is_west
    is_along: BoolArray = (fixes.lat_deg >= area.south_deg) & (fixes.lat_deg <= area.north_deg)
    return is_along & is_across


def _fitted(fixes: MovingFixes, tolerance_m: float, most: int) -> tuple[MovingFixes, float]:
    """Thin until no more than `most` points are left, or each track is as short as it can be."""
    silence_s = LONGEST_SILENCE.total_seconds()
    while True:
        time_s, lat_deg, lon_deg = (
            column.tolist() for column in (fixes.time_s, fixes.lat_deg, fixes.lon_deg)
        )
        kept = [
            own.start + index
            for own in fixes.slices()
            for index in thinned(time_s[own], lat_deg[own], lon_deg[own], tolerance_m, silence_s)
        ]
        fixes = fixes.taken(np.array(kept, dtype=np.int64))
        if len(fixes) <= most or tolerance_m > 10_000:
            return fixes, tolerance_m
        tolerance_m *= 2
