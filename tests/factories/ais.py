"""Recordings as bytes, and rows of AIS."""

from datetime import UTC, datetime, timedelta

from sqlalchemy.orm import Session

from app.tables.ais import AisPosition, AisStatic, Vessel
from app.tables.sites import Site

NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)
MMSI = 211_000_001


def table(rows: int = 3, *, mmsi: int = MMSI, first: datetime = NOON) -> bytes:
    """Return a plain CSV of one vessel going east, a row every ten seconds, with its size."""
    lines = ["mmsi,time,lat,lon,sog,cog,heading,to_bow,to_stern,to_port,to_starboard,name"]
    for number in range(rows):
        time = first + timedelta(seconds=10 * number)
        lon = 9.98 + 0.001 * number
        lines.append(f"{mmsi},{time:%Y-%m-%dT%H:%M:%SZ},53.54,{lon:.5f},9.5,90,91,8,11,4,3,ELBE 3")
    return "\n".join(lines).encode()


def make_position(
    session: Session,
    site: Site | None,
    at: datetime = NOON,
    *,
    mmsi: int = MMSI,
    lat_deg: float = 53.54,
    lon_deg: float = 9.98,
) -> AisPosition:
    """Insert a position, shared by all sites without one."""
    position = AisPosition(
        site_id=site.id if site else None,
        mmsi=mmsi,
        fix_time=at,
        received_at=at,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        sog_kn=9.5,
        cog_deg=90.0,
        heading_deg=91.0,
        message_type=1,
        ais_class="A",
        high_accuracy=True,
    )
    session.add(position)
    session.flush()
    return position


def make_static(
    session: Session,
    site: Site | None,
    at: datetime = NOON,
    *,
    mmsi: int = MMSI,
    name: str = "ELBE 3",
) -> AisStatic:
    """Insert a static report, shared by all sites without one."""
    static = AisStatic(
        site_id=site.id if site else None,
        mmsi=mmsi,
        received_at=at,
        name=name,
        to_bow_m=8.0,
        to_stern_m=11.0,
        to_port_m=4.0,
        to_starboard_m=3.0,
    )
    session.add(static)
    session.flush()
    return static


def make_vessel(session: Session, *, mmsi: int = MMSI, name: str | None = "ELBE 3") -> Vessel:
    """Insert a vessel as last heard of."""
    vessel = Vessel(mmsi=mmsi, name=name, first_seen_at=NOON, last_seen_at=NOON)
    session.add(vessel)
    session.flush()
    return vessel
