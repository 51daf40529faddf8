"""Answers about vessels and what they sent, as the caller may know them.

Units stand in the names; null stands for "not available", or for what would name a vessel whose
identity the caller may not see.
"""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from app.ais.service import Track
from app.domain.plausibility import Doubt
from app.identities.shown import Identities, VesselId
from app.tables.ais import AisPosition, AisStatic, Vessel

Told = Annotated[
    VesselId,
    Field(description="An MMSI, or the vessel's pseudonym at the site", examples=[211234560]),
]


class PositionOut(BaseModel):
    """A position report (ITU-R M.1371 types 1, 2, 3, 18, 19; 0: a row of a table)."""

    id: int
    site_id: int | None
    file_id: int | None
    feed_id: int | None
    mmsi: Told
    fix_time: datetime
    received_at: datetime = Field(description="By the receiver's clock")
    arrived_at: datetime | None = Field(description="By this server's clock; only of live feeds")
    lat_deg: float
    lon_deg: float
    sog_kn: float | None
    cog_deg: float | None
    heading_deg: float | None
    rot_deg_min: float | None
    message_type: int | None
    ais_class: str | None
    high_accuracy: bool | None
    fix_time_source: str
    doubts: list[Doubt] = Field(
        description="What is hard to believe of it, given all that its vessel sent; none is deleted"
    )

    @classmethod
    def of(
        cls, position: AisPosition, told: Identities, doubts: Mapping[int, list[Doubt]]
    ) -> "PositionOut":
        """Show a row; `doubts` are those of positions by their id."""
        names = [name for name in cls.model_fields if name not in {"mmsi", "doubts"}]
        return cls(
            mmsi=told.vessel(position.mmsi),
            doubts=doubts[position.id],
            **{name: getattr(position, name) for name in names},
        )


class StaticOut(BaseModel):
    """A static report: what a vessel says of itself, and where its antenna stands on its hull."""

    id: int
    received_at: datetime
    name: str | None
    callsign: str | None
    imo: int | None
    ship_type: int | None
    to_bow_m: float | None
    to_stern_m: float | None
    to_port_m: float | None
    to_starboard_m: float | None
    mothership_mmsi: Told | None

    @classmethod
    def of(cls, static: AisStatic, told: Identities) -> "StaticOut":
        """Show a row."""
        mother = static.mothership_mmsi
        return cls(
            id=static.id,
            received_at=static.received_at,
            name=told.name(static.name),
            callsign=told.name(static.callsign),
            imo=told.number(static.imo),
            ship_type=static.ship_type,
            to_bow_m=static.to_bow_m,
            to_stern_m=static.to_stern_m,
            to_port_m=static.to_port_m,
            to_starboard_m=static.to_starboard_m,
            mothership_mmsi=None if mother is None else told.vessel(mother),
        )


class VesselOut(BaseModel):
    """A vessel as last heard of."""

    mmsi: Told
    name: str | None
    callsign: str | None
    imo: int | None
    ship_type: int | None
    length_m: float | None
    width_m: float | None
    first_seen_at: datetime
    last_seen_at: datetime

    @classmethod
    def of(cls, vessel: Vessel, told: Identities) -> "VesselOut":
        """Show a row."""
        return cls(
            mmsi=told.vessel(vessel.mmsi),
            name=told.name(vessel.name),
            callsign=told.name(vessel.callsign),
            imo=told.number(vessel.imo),
            ship_type=vessel.ship_type,
            length_m=vessel.length_m,
            width_m=vessel.width_m,
            first_seen_at=vessel.first_seen_at,
            last_seen_at=vessel.last_seen_at,
        )


class VesselDetailOut(VesselOut):
    """A vessel with its latest static and position report, where there is one."""

    latest_static: StaticOut | None
    latest_position: PositionOut | None

    @classmethod
    def with_latest(
        cls,
        vessel: Vessel,
        static: AisStatic | None,
        position: AisPosition | None,
        told: Identities,
        doubts: Mapping[int, list[Doubt]],
    ) -> "VesselDetailOut":
        """Put a vessel and its latest reports together."""
        return cls(
            **VesselOut.of(vessel, told).model_dump(),
            latest_static=StaticOut.of(static, told) if static else None,
            latest_position=PositionOut.of(position, told, doubts) if position else None,
        )


class Geometry(BaseModel):
    """A GeoJSON geometry: longitude before latitude."""

    type: Literal["LineString", "Point"]
    coordinates: list[list[float]] | list[float]


class TrackProperties(BaseModel):
    """What belongs to the points of a piece, one entry a point."""

    mmsi: Told
    first: datetime
    last: datetime
    times: list[datetime]
    sog_kn: list[float | None]
    cog_deg: list[float | None]
    heading_deg: list[float | None]


class TrackFeature(BaseModel):
    """An unbroken piece of a track."""

    type: Literal["Feature"] = "Feature"
    geometry: Geometry
    properties: TrackProperties


class TrackOut(BaseModel):
    """A track as GeoJSON (RFC 7946): a feature for each piece between silences over ten minutes."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[TrackFeature]
    truncated: bool = Field(description="Whether older positions were left out")

    @classmethod
    def of(cls, track: Track, told: Identities) -> "TrackOut":
        """Show a track."""
        return cls(
            features=[_feature(told.vessel(track.mmsi), piece) for piece in track.pieces],
            truncated=track.truncated,
        )


def _feature(mmsi: VesselId, piece: list[AisPosition]) -> TrackFeature:
    points = [[position.lon_deg, position.lat_deg] for position in piece]
    return TrackFeature(
        geometry=Geometry(type="LineString", coordinates=points)
        if len(points) > 1
        else Geometry(type="Point", coordinates=points[0]),
        properties=TrackProperties(
            mmsi=mmsi,
            first=piece[0].fix_time,
            last=piece[-1].fix_time,
            times=[position.fix_time for position in piece],
            sog_kn=[position.sog_kn for position in piece],
            cog_deg=[position.cog_deg for position in piece],
            heading_deg=[position.heading_deg for position in piece],
        ),
    )
