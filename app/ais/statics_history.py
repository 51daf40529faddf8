"""What a vessel said of itself over time: each change once, not each report."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

from app.ais.ship_types import ship_type_name
from app.identities.shown import Identities
from app.tables.ais import AisStatic

_FIELDS = (
    ("name", "Name"),
    ("callsign", "Call sign"),
    ("imo", "IMO number"),
    ("ship_type", "Type"),
    ("hull", "Antenna on the hull"),
    ("mothership_mmsi", "Mother ship"),
)


@dataclass(frozen=True, slots=True)
class Change:
    """A field that a vessel said for the first time, or otherwise than before (`was` None)."""

    at: datetime
    field: str
    was: str | None
    now: str


def changes(statics: Iterable[AisStatic], told: Identities) -> list[Change]:
    """Return the changes of static reports (oldest first), newest first, as they may be told.

    Where a field is not said, it stays as it was: a report of type 24 carries one half of them.
    """
    known: dict[str, str] = {}
    found = []
    for static in statics:
        for field, label in _FIELDS:
            value = _said(static, field, told)
            if value is not None and value != known.get(field):
                found.append(Change(static.received_at, label, known.get(field), value))
                known[field] = value
    return found[::-1]


def _said(static: AisStatic, field: str, told: Identities) -> str | None:
    if field == "hull":
        sides = (static.to_bow_m, static.to_stern_m, static.to_port_m, static.to_starboard_m)
        if any(side is None for side in sides):
            return None
        bow, stern, port, starboard = sides
        return f"{bow:g} m to the bow, {stern:g} stern, {port:g} port, {starboard:g} starboard"
    if field == "ship_type":
        return ship_type_name(static.ship_type)
    if field == "mothership_mmsi":
        mother = static.mothership_mmsi
        return None if mother is None else str(told.vessel(mother))
    if field == "imo":
        imo = told.number(static.imo)
        return None if imo is None else str(imo)
    return told.name(static.name if field == "name" else static.callsign)
