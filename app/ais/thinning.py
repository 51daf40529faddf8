"""Thinning a track for a drawing: no more points than its bends and the map's scale ask for.

A point is kept where the vessel is further than a tolerance from where it would be, had it gone on
as between the last two kept points. One is kept every few minutes whatever happens, so that a
vessel at its berth does not look silent; and the points beside a silence are always kept.
"""

import math
from collections.abc import Sequence

LONGEST_STEP_S = 240.0
METRES_PER_DEG = 111_320.0


def thinned(
    time_s: Sequence[float],
    lat_deg: Sequence[float],
    lon_deg: Sequence[float],
    tolerance_m: float,
    longest_silence_s: float,
) -> list[int]:
    """Return which fixes of a vessel a drawing needs, in their order.

    Args:
        time_s: of its fixes, the oldest first; there is one at least.
        lat_deg: where they are.
        lon_deg: where they are.
        tolerance_m: how far the drawn track may be from the reported one.
        longest_silence_s: a longer step is a silence: the points on both sides stay.

    """
    if len(time_s) < 3:
        return list(range(len(time_s)))
    across = math.cos(math.radians(lat_deg[0]))  # degrees of longitude as those of latitude
    limit = (tolerance_m / METRES_PER_DEG) ** 2
    kept = [0]
    last_s, last_lat, last_lon = time_s[0], lat_deg[0], lon_deg[0]
    north_speed = east_speed = 0.0  # degrees a second from the last kept point on
    before_s = last_s
    for index, (at_s, lat, lon) in enumerate(zip(time_s, lat_deg, lon_deg, strict=True)):
        since_s = at_s - last_s
        if at_s - before_s > longest_silence_s:
            if kept[-1] != index - 1:
                kept.append(index - 1)
            north_speed = east_speed = 0.0
        else:
            north = lat - last_lat - north_speed * since_s
            east = (lon - last_lon - east_speed * since_s) * across
            if since_s < LONGEST_STEP_S and north * north + east * east <= limit:
                before_s = at_s
                continue
            if since_s > 0:
                north_speed, east_speed = (lat - last_lat) / since_s, (lon - last_lon) / since_s
        kept.append(index)
        last_s, last_lat, last_lon, before_s = at_s, lat, lon, at_s
    if kept[-1] != len(time_s) - 1:
        kept.append(len(time_s) - 1)
    return kept
