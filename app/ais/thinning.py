"""Thinning a track for a drawing: no more points than its bends and the map's scale ask for.

A point is kept where the vessel is further than a tolerance from where it would be, had it gone on
as between the last two kept points. One is kept every few minutes whatever happens, so that a
vessel at its berth does not look silent; and the points beside a silence are always kept.
"""

from collections.abc import Sequence
from typing import NamedTuple

from app.domain.ais import FixTimeSource

LONGEST_STEP_S = 240.0
METRES_PER_DEG = 111_320.0


class Fix(NamedTuple):
    """Where a vessel was: seconds since any moment, degrees, knots; None for what is unknown."""

    time_s: float
    lat_deg: float
    lon_deg: float
    sog_kn: float | None
    cog_deg: float | None
    heading_deg: float | None
    source: str = FixTimeSource.PROMPT


def thinned(
    fixes: Sequence[Fix], tolerance_m: float, across: float, longest_silence_s: float
) -> list[Fix]:
    """Return the fixes that a drawing needs, in their order.

    Args:
        fixes: of one vessel, oldest first.
        tolerance_m: how far the drawn track may be from the reported one.
        across: cosine of the latitude, for metres per degree of longitude.
        longest_silence_s: a longer step is a silence: the points on both sides stay.

    """
    if len(fixes) < 3:
        return list(fixes)
    kept = [fixes[0]]
    speed = (0.0, 0.0)  # degrees a second from the last kept point on
    limit = (tolerance_m / METRES_PER_DEG) ** 2
    before = fixes[0]
    for fix in fixes[1:]:
        last = kept[-1]
        if fix.time_s - before.time_s > longest_silence_s:
            if before is not last:
                kept.append(before)
            kept.append(fix)
            speed = (0.0, 0.0)
        else:
            since_s = fix.time_s - last.time_s
            north = fix.lat_deg - last.lat_deg - speed[0] * since_s
            east = (fix.lon_deg - last.lon_deg - speed[1] * since_s) * across
            if since_s >= LONGEST_STEP_S or north * north + east * east > limit:
                if since_s > 0:
                    speed = (
                        (fix.lat_deg - last.lat_deg) / since_s,
                        (fix.lon_deg - last.lon_deg) / since_s,
                    )
                kept.append(fix)
        before = fix
    if kept[-1] is not before:
        kept.append(before)
    return kept
