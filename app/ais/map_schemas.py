"""Answers for the map: tracks as short lists of whole numbers, and what the cameras look at."""

from datetime import datetime

from pydantic import BaseModel, Field

from app.ais.map_tracks import Moved, Stretch
from app.ais.ship_types import ship_type_name
from app.ais.track import LONGEST_SILENCE
from app.ais.vessel_schemas import Told
from app.identities.shown import Identities

DEGREES = 1e5
_UNKNOWN = -1


class MovedOut(BaseModel):
    """A vessel and its points, one entry a point in each list."""

    mmsi: Told
    name: str | None
    ship_type: str | None
    ais_class: str | None
    length_m: float | None
    width_m: float | None
    flags: list[str] = Field(description="What is not plausible of it in this stretch")
    t: list[int] = Field(description="Seconds: the first since `from`, then each since the last")
    lat: list[int] = Field(description="1e-5 degrees: the first, then each less the last")
    lon: list[int] = Field(description="1e-5 degrees: the first, then each less the last")
    sog: list[int] = Field(description="Tenths of a knot; -1 where unknown")
    cog: list[int] = Field(description="Degrees; -1 where unknown")
    heading: list[int] = Field(description="Degrees; -1 where unknown")

    @classmethod
    def of(cls, moved: Moved, told: Identities) -> "MovedOut":
        """Put a vessel and its points into whole numbers."""
        fixes, vessel = moved.fixes, moved.vessel
        return cls(
            mmsi=told.vessel(moved.mmsi),
            name=told.name(vessel.name) if vessel else None,
            ship_type=ship_type_name(vessel.ship_type) if vessel else None,
            ais_class=moved.ais_class,
            length_m=vessel.length_m if vessel else None,
            width_m=vessel.width_m if vessel else None,
            flags=[doubt.value for doubt in moved.doubts],
            t=_steps([round(fix.time_s) for fix in fixes]),
            lat=_steps([round(fix.lat_deg * DEGREES) for fix in fixes]),
            lon=_steps([round(fix.lon_deg * DEGREES) for fix in fixes]),
            sog=[_whole(fix.sog_kn, 10) for fix in fixes],
            cog=[_whole(fix.cog_deg) for fix in fixes],
            heading=[_whole(fix.heading_deg) for fix in fixes],
        )


class StretchOut(BaseModel):
    """The tracks of a stretch of time, thinned to the tolerance."""

    start: datetime
    end: datetime
    read_until: datetime = Field(description="Earlier than `end` where the traffic was too much")
    tolerance_m: float
    longest_silence_s: int = Field(description="A longer step between points is a gap")
    vessels: list[MovedOut]

    @classmethod
    def of(cls, found: Stretch, told: Identities) -> "StretchOut":
        """Put all tracks into whole numbers, where MMSI are hidden in no telling order."""
        vessels = [MovedOut.of(moved, told) for moved in found.tracks]
        return cls(
            start=found.start,
            end=found.end,
            read_until=found.read_until,
            tolerance_m=found.tolerance_m,
            longest_silence_s=int(LONGEST_SILENCE.total_seconds()),
            vessels=sorted(vessels, key=lambda vessel: str(vessel.mmsi)),
        )


class FieldOfViewOut(BaseModel):
    """What a viewport looks at: its camera, then the far ends of its view from left to right."""

    viewport_id: int
    name: str
    camera: str
    valid_from: datetime | None
    valid_until: datetime | None
    lat_deg: list[float]
    lon_deg: list[float]


def _steps(values: list[int]) -> list[int]:
    return [value - before for value, before in zip(values, [0, *values[:-1]], strict=True)]


def _whole(value: float | None, scale: int = 1) -> int:
    return _UNKNOWN if value is None else round(value * scale)
