"""A stretch of tracks as JSON: whole numbers, each the difference from the one before.

A thousand tracks are a quarter of a million numbers. They are rounded and subtracted as columns and
written as they are: building `StretchOut`, which describes the answer, takes as long as reading it.
"""

import numpy as np
import orjson

from app.ais.map_tracks import Stretch
from app.ais.moving_fixes import MovingFixes
from app.ais.ship_types import ship_type_name
from app.ais.track import LONGEST_SILENCE
from app.domain.ais_bulk import AIS_CLASSES
from app.domain.arrays import FloatArray, IntArray
from app.identities.shown import Identities

DEGREES = 1e5
_UNKNOWN = -1
_AS_JSON = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_UTC_Z


def as_json(found: Stretch, told: Identities, **more: int | bool) -> bytes:
    """Write all tracks as `StretchOut` says, where MMSI are hidden in no telling order.

    `more` are members beside.
    """
    fixes = found.fixes
    columns = _columns(fixes)
    vessels = []
    for own in fixes.slices():
        mmsi = int(fixes.mmsi[own.start])
        vessel = found.vessels.get(mmsi)
        vessels.append(
            {
                "mmsi": told.vessel(mmsi),
                "name": told.name(vessel.name) if vessel else None,
                "ship_type": ship_type_name(vessel.ship_type) if vessel else None,
                "ais_class": AIS_CLASSES[_last_known(fixes.ais_class[own])],
                "length_m": vessel.length_m if vessel else None,
                "width_m": vessel.width_m if vessel else None,
                "flags": [doubt.value for doubt in found.doubts.get(mmsi, ())],
                **{name: column[own] for name, column in columns.items()},
            }
        )
    answer = {
        "start": found.start,
        "end": found.end,
        "read_until": found.read_until,
        "tolerance_m": found.tolerance_m,
        "longest_silence_s": int(LONGEST_SILENCE.total_seconds()),
        "vessels": sorted(vessels, key=lambda vessel: str(vessel["mmsi"])),
        **more,
    }
    return orjson.dumps(answer, option=_AS_JSON)


def _columns(fixes: MovingFixes) -> dict[str, IntArray]:
    starts = fixes.starts
    return {
        "t": _steps(fixes.time_s, starts),
        "lat": _steps(fixes.lat_deg * DEGREES, starts),
        "lon": _steps(fixes.lon_deg * DEGREES, starts),
        "sog": _whole(fixes.sog_kn * 10),
        "cog": _whole(fixes.cog_deg),
        "heading": _whole(fixes.heading_deg),
    }


def _steps(values: FloatArray, starts: IntArray) -> IntArray:
    """Return each vessel's first value, then the differences, of values rounded before."""
    whole = np.rint(values).astype(np.int64)
    steps = np.diff(whole, prepend=0)
    steps[starts] = whole[starts]
    return steps


def _whole(values: FloatArray) -> IntArray:
    return np.where(np.isnan(values), _UNKNOWN, np.rint(values)).astype(np.int64)


def _last_known(numbers: IntArray) -> int:
    known = numbers[numbers > 0]
    return int(known[-1]) if known.size else 0
