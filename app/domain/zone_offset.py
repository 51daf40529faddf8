"""A camera's clock that is whole hours off: summer time forgotten, or local time taken for UTC.

That is the commonest mistake with a clock, and far outside the search around zero. Wherever the
vessels near the times that the clock told explain nothing, whole and half hours are tried, each
with the same fine search around it. So many trials find something by chance, which takes a guard:
more vessels have to agree, on more of what was detected, and more clearly than anywhere else.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from app.domain.clock_offset import OffsetEstimate, OffsetSettings, estimate_offset
from app.domain.clock_sight import TimedImage
from app.domain.vessel_path import VesselPath

HALF_HOUR_S = 1800.0
_HOUR_S = 3600.0
_ZONE_S = 60.0  # a clock nearer than this to whole half hours has its zone wrong, and no more
PathsAround = Callable[[float], Sequence[VesselPath]]


@dataclass(frozen=True, slots=True)
class ZoneSettings:
    """How many half hours to try on each side, and what it takes to believe one.

    Of images of right clocks, without AIS of their own time among that of other times, none was
    believed; see `benchmarks/bench_clock_offset.py`.
    """

    half_hours: int = 28
    least_vessels: int = 5
    least_gain: float = 20.0  # of log likelihood, over every offset elsewhere
    least_share: float = 0.25  # of detections that a moving vessel explains


def find_offset(
    images: Sequence[TimedImage],
    paths_around: PathsAround,
    settings: OffsetSettings,
    zones: ZoneSettings | None = None,
    near: OffsetEstimate | None = None,
) -> OffsetEstimate:
    """Estimate an offset near zero, else near whole or half hours where `zones` says so.

    `paths_around(shift_s)` gives the vessels around the images' times so many seconds later; its
    times are on the scale of `clock_s`. `near` is the estimate near zero where there is one.
    """
    near = near or estimate_offset(images, paths_around(0.0), settings)
    if near.is_known or zones is None or near.detection_count < zones.least_vessels:
        return near
    strict = replace(settings, least_vessels=zones.least_vessels, least_gain=zones.least_gain)
    tried = {0.0: near}
    for number in range(1, zones.half_hours + 1):
        for shift_s in (number * HALF_HOUR_S, -number * HALF_HOUR_S):
            paths = paths_around(shift_s)
            if len(paths) >= zones.least_vessels:
                later = [replace(image, clock_s=image.clock_s + shift_s) for image in images]
                tried[shift_s] = estimate_offset(later, paths, strict)
    best_s = max(tried, key=lambda shift_s: tried[shift_s].score)
    best = tried.pop(best_s)
    rival = max((other.score for other in tried.values()), default=0.0)
    is_clear = best.is_known and best.score - rival >= zones.least_gain
    share = best.pair_count / max(best.detection_count, 1)
    if best_s == 0 or not is_clear or share < zones.least_share:
        return near
    return _in_words(best, best_s)


def _in_words(found: OffsetEstimate, shift_s: float) -> OffsetEstimate:
    """Return what was found around a shift as the whole offset, and what it looks like."""
    offset_s = found.offset_s + shift_s
    side = "slow" if offset_s > 0 else "fast"
    message = f"the clock is {span_in_words(offset_s)} {side}"
    if abs(found.offset_s) <= _ZONE_S:
        likely = "summer time" if abs(shift_s) == _HOUR_S else "another time zone"
        message += f": looks like {likely}"
    if found.is_receiver:
        message = found.message
    return replace(
        found,
        offset_s=offset_s,
        low_s=found.low_s + shift_s,
        high_s=found.high_s + shift_s,
        is_off=not found.is_receiver,
        message=message,
    )


def span_in_words(seconds: float) -> str:
    """Return a length of time such as `1 h 0 s` or `5 h 30 min 2 s`, without its sign."""
    whole = round(abs(seconds))
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    parts = [f"{hours} h"] * (hours > 0) + [f"{minutes} min"] * (minutes > 0) + [f"{rest} s"]
    return " ".join(parts)
