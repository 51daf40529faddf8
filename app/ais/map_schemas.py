"""Answers for the map: tracks as short lists of whole numbers, and what the cameras look at."""

from datetime import datetime

from pydantic import BaseModel, Field

from app.ais.vessel_schemas import Told


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


class StretchOut(BaseModel):
    """The tracks of a stretch of time, thinned to the tolerance."""

    start: datetime
    end: datetime
    read_until: datetime = Field(description="Earlier than `end` where the traffic was too much")
    tolerance_m: float
    longest_silence_s: int = Field(description="A longer step between points is a gap")
    vessels: list[MovedOut]


class NewsOut(StretchOut):
    """What live feeds brought since the last answer; `end` is the server's now."""

    after: int = Field(description="Send it with the next request")
    is_cut: bool = Field(description="It was too much: ask for the tracks of now again")


class FieldOfViewOut(BaseModel):
    """What a viewport looks at: its camera, then the far ends of its view from left to right."""

    viewport_id: int
    name: str
    camera: str
    valid_from: datetime | None
    valid_until: datetime | None
    lat_deg: list[float]
    lon_deg: list[float]
