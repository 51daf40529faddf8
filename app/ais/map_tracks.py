"""The tracks of a stretch of time, small enough to send and to draw whatever the traffic.

Two bounds hold: how many positions are read, and how many points are sent. Where the second would
be exceeded, all tracks are thinned more until it is not; where the first is, the answer says until
when it reaches.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.ais import map_repository
from app.ais.area import Area
from app.ais.report_repository import Readable
from app.ais.thinning import Fix, thinned
from app.ais.track import LONGEST_SILENCE
from app.ais.track_doubts import doubts_of
from app.domain.plausibility import Doubt
from app.errors import Invalid
from app.tables.ais import Vessel

LONGEST_STRETCH = timedelta(hours=6)
MOST_READ = 400_000
MOST_SENT = 60_000


@dataclass(frozen=True, slots=True)
class Moved:
    """A vessel's thinned track; `vessel` is None for one that nothing else is known of."""

    mmsi: int
    vessel: Vessel | None
    ais_class: str | None
    fixes: list[Fix]
    doubts: list[Doubt]


@dataclass(frozen=True, slots=True)
class Stretch:
    """All tracks between two moments; `read_until` is earlier than `end` where it was too much."""

    start: datetime
    end: datetime
    read_until: datetime
    tolerance_m: float
    tracks: list[Moved]


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
    fixes: dict[int, list[Fix]] = {}
    classes: dict[int, str | None] = {}
    start_s = start.timestamp()
    since_s, count = 0.0, 0
    for row in map_repository.moving(session, readable, start, end, area, MOST_READ):
        mmsi, epoch_s, lat_deg, lon_deg, sog_kn, cog_deg, heading_deg, source, ais_class = row
        since_s = round(epoch_s - start_s, 2)
        fix = Fix(since_s, lat_deg, lon_deg, sog_kn, cog_deg, heading_deg, source)
        own = fixes.setdefault(mmsi, [])
        count += 1
        # The same fix may stand in a site's file and in one shared by all.
        if not own or own[-1].time_s < fix.time_s:
            own.append(fix)
        classes[mmsi] = ais_class or classes.get(mmsi)
    kept, tolerance_m = _fitted(fixes, tolerance_m, most)
    vessels = map_repository.vessels(session, kept)
    return Stretch(
        start=start,
        end=end,
        read_until=start + timedelta(seconds=since_s) if count >= MOST_READ else end,
        tolerance_m=tolerance_m,
        tracks=[
            Moved(mmsi, vessels.get(mmsi), classes[mmsi], own, doubts_of(mmsi, fixes[mmsi], start))
            for mmsi, own in kept.items()
        ],
    )


def _fitted(
    fixes: Mapping[int, list[Fix]], tolerance_m: float, most: int
) -> tuple[dict[int, list[Fix]], float]:
    """Thin until no more than `most` points are left, or each track is as short as it can be."""
    silence_s = LONGEST_SILENCE.total_seconds()
    kept = dict(fixes)
    while True:
        kept = {
            mmsi: thinned(own, tolerance_m, math.cos(math.radians(own[0].lat_deg)), silence_s)
            for mmsi, own in kept.items()
        }
        if sum(map(len, kept.values())) <= most or tolerance_m > 10_000:
            return kept, tolerance_m
        tolerance_m *= 2
