"""Answers of AIS. Units stand in the names; null stands for "not available"."""

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.ais.service import Track
from app.tables.ais import AisFile, AisPosition, AisStatic, Vessel

_ACCOUNTING_EXAMPLE = {
    "lines": {"total": 4, "sentence": 3, "time_only": 1, "other": 0, "dropped": 0},
    "sentences": {"total": 3, "assembled": 2, "rejected": {"checksum": 1}, "orphaned": 0},
    "messages": {
        "assembled": 2,
        "positions": 1,
        "statics": 0,
        "duplicates": 1,
        "ignored_type": 0,
        "rejected": {},
    },
}


class AccountingOut(BaseModel):
    """What became of every line, sentence and message; each of the three sums is exact."""

    lines: dict[str, int]
    sentences: dict[str, Any]
    messages: dict[str, Any]


class AisFileOut(BaseModel):
    """An imported recording."""

    id: int
    site_id: int | None = Field(description="null: shared by all sites")
    file_name: str
    format: str = Field(
        description="nmea, csv, nmea+gzip, csv+gzip, or an archive such as zip(csv,nmea)"
    )
    sha256: str
    size_bytes: int
    accounting: AccountingOut = Field(examples=[_ACCOUNTING_EXAMPLE])
    vessels: int = Field(description="How many vessels it speaks of")
    first: datetime | None
    last: datetime | None
    created_at: datetime

    @classmethod
    def of(cls, file: AisFile) -> "AisFileOut":
        """Show a row."""
        return cls(
            id=file.id,
            site_id=file.site_id,
            file_name=file.file_name,
            format=file.format,
            sha256=file.sha256,
            size_bytes=file.size_bytes,
            accounting=AccountingOut.model_validate(file.accounting),
            vessels=file.accounting.get("vessels", 0),
            first=file.first_at,
            last=file.last_at,
            created_at=file.created_at,
        )


class PositionOut(BaseModel):
    """A position report (ITU-R M.1371 types 1, 2, 3, 18, 19; 0: a row of a table)."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    site_id: int | None
    file_id: int | None
    mmsi: int
    fix_time: datetime
    received_at: datetime
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


class StaticOut(BaseModel):
    """A static report: what a vessel says of itself, and where its antenna stands on its hull."""

    model_config = ConfigDict(from_attributes=True)

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
    mothership_mmsi: int | None


class VesselOut(BaseModel):
    """A vessel as last heard of."""

    model_config = ConfigDict(from_attributes=True)

    mmsi: int
    name: str | None
    callsign: str | None
    imo: int | None
    ship_type: int | None
    length_m: float | None
    width_m: float | None
    first_seen_at: datetime
    last_seen_at: datetime


class VesselDetailOut(VesselOut):
    """A vessel with its latest static and position report, where there is one."""

    latest_static: StaticOut | None
    latest_position: PositionOut | None

    @classmethod
    def with_latest(
        cls, vessel: Vessel, static: AisStatic | None, position: AisPosition | None
    ) -> "VesselDetailOut":
        """Put a vessel and its latest reports together."""
        return cls(
            **VesselOut.model_validate(vessel).model_dump(),
            latest_static=StaticOut.model_validate(static) if static else None,
            latest_position=PositionOut.model_validate(position) if position else None,
        )


class Geometry(BaseModel):
    """A GeoJSON geometry: longitude before latitude."""

    type: Literal["LineString", "Point"]
    coordinates: list[list[float]] | list[float]


class TrackProperties(BaseModel):
    """What belongs to the points of a piece, one entry a point."""

    mmsi: int
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
    def of(cls, track: Track) -> "TrackOut":
        """Show a track."""
        return cls(
            features=[_feature(track.mmsi, piece) for piece in track.pieces],
            truncated=track.truncated,
        )


def _feature(mmsi: int, piece: list[AisPosition]) -> TrackFeature:
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
