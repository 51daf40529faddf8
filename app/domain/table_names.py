"""What the columns of known and unknown tables are called, and what such names mean.

Archives agree on little but the letters: `BaseDateTime`, `base_date_time` and `Base Date Time` are
one name. So names are compared without case, blanks and punctuation, and without a unit behind
them. The Danish archive's A to D are the four distances in the order of ITU-R M.1371; its own
description swaps C and D, so whoever knows better can change the mapping.

Sources: headers of the Danish Maritime Authority (22 and 26 columns), MarineCadastre (2009 to 2023
and from 2024 on), AIS-catcher, Stone Soup, aisdb and several national archives.
"""

import re
from collections.abc import Sequence

from app.domain.table_mapping import SpeedUnit

_NAMES: dict[str, str] = {
    "mmsi": "mmsi mmsinumber mmsino sourcemmsi vesselmmsi shipmmsi userid",
    "time": "time timestamp basedatetime datetime datetimeutc timestamputc timeutc utctime utc "
    "tstamp ts t epoch epochtime unixtime unixtimestamp rxtime rxuxtime receivedat receivetime "
    "received msgtime positiontime posdatetime movementdatetime eventtime dtposutc dt zeit "
    "zeitstempel zeitpunkt",
    "lat": "lat latitude latitudedegrees latdegrees latdeg latitudedeg latitudewgs84 y "
    "breite breitengrad breitegrad",
    "lon": "lon lng long longitude longitudedegrees londegrees londeg longitudedeg longitudewgs84 "
    "x laengengrad lngengrad laenge lnge",
    "sog": "sog speed speedoverground groundspeed sogknots speedknots fahrt geschwindigkeit",
    "cog": "cog course courseoverground cogdegrees coursedegrees cogdeg track kurs kursuebergrund",
    "heading": "heading hdg trueheading headingdegrees headingdeg hdt vorausrichtung",
    "rot": "rot turn rateofturn rotdegmin drehrate wendegeschwindigkeit",
    "to_bow": "tobow a sizea dima dimensiona dimensiontobow dimbow bow",
    "to_stern": "tostern b sizeb dimb dimensionb dimensiontostern dimstern stern",
    "to_port": "toport c sizec dimc dimensionc dimensiontoport dimport",
    "to_starboard": "tostarboard d sized dimd dimensiond dimensiontostarboard dimstarboard",
    "name": "name vesselname shipname schiffsname schiff",
    "callsign": "callsign rufzeichen",
    "imo": "imo imonumber imono imonr",
    "ship_type": "shiptype vesseltype shipandcargotype shipcargotype typeandcargo shiptypecode "
    "vesseltypecode schiffstyp",
    "length": "length vessellength shiplength loa len",
    "width": "width beam breadth vesselwidth shipwidth breadthmoulded",
    "ais_class": "aisclass transceiverclass transceiver typeofmobile class mobiletype",
}
_MEANING = {name: field for field, names in _NAMES.items() for name in names.split()}
_UNIT = re.compile(
    r"[\s_(\[-]*(m/s|ms-?1|mps|m_s|km/?h|kph|knots|knot|kts|kt|kn|degrees|degree|deg|dd|m|utc)"
    r"[)\]]?$",
    re.IGNORECASE,
)
_MPS = frozenset({"m/s", "ms1", "ms-1", "mps", "m_s"})
_KMH = frozenset({"km/h", "kmh", "kph"})

# What the Danish archive writes for what nobody knows.
UNKNOWN_WORDS = frozenset({"unknown", "unknown value", "undefined", "null", "none", "nan", "n/a"})
# Its words for types of ships, as the number that messages carry (ITU-R M.1371, table 53).
SHIP_TYPE_WORDS = {
    "wig": 20,
    "fishing": 30,
    "towing": 31,
    "towing long/wide": 32,
    "dredging": 33,
    "diving": 34,
    "military": 35,
    "sailing": 36,
    "pleasure": 37,
    "hsc": 40,
    "pilot": 50,
    "sar": 51,
    "tug": 52,
    "port tender": 53,
    "anti-pollution": 54,
    "law enforcement": 55,
    "medical": 58,
    "not party to conflict": 59,
    "passenger": 60,
    "cargo": 70,
    "tanker": 80,
    "other": 90,
}


def meanings(header: Sequence[str]) -> dict[str, int]:
    """Return which column holds what, as far as the names in a header tell; the first one wins."""
    found: dict[str, int] = {}
    for index, cell in enumerate(header):
        field = _meaning(cell)
        if field is not None:
            found.setdefault(field, index)
    dates = [index for index, cell in enumerate(header) if _plain(cell) in {"date", "datum", "day"}]
    if dates:
        if "time" in found:
            found["clock"] = found["time"]
        found["time"] = dates[0]
    return found


def speed_unit(header: Sequence[str], column: int | None) -> SpeedUnit:
    """Return the unit that stands in the name of a column of speeds; knots if none does."""
    match = _UNIT.search(header[column].strip()) if column is not None else None
    unit = match[1].lower() if match else ""
    if unit in _MPS:
        return SpeedUnit.METRES_PER_SECOND
    return SpeedUnit.KILOMETRES_PER_HOUR if unit in _KMH else SpeedUnit.KNOTS


def _meaning(cell: str) -> str | None:
    whole = _MEANING.get(_plain(cell))
    return whole or _MEANING.get(_plain(_UNIT.sub("", cell.strip())))


def _plain(cell: str) -> str:
    return re.sub(r"[^a-z0-9]", "", cell.lower())
