"""Tables of archives and of spreadsheets are read the way their header and values say."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.accounting import MessageReject
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_csv import CsvDecoder
from app.domain.rejects import Reject, RejectLog
from app.domain.table_mapping import FIELDS, MappingError, SpeedUnit, TableMapping, TimeFormat
from app.domain.table_proposal import propose
from app.domain.vessel_statics import hull_of

DANISH = (
    "# Timestamp,Type of mobile,MMSI,Latitude,Longitude,Navigational status,ROT,SOG,COG,Heading,"
    "IMO,Callsign,Name,Ship type,Cargo type,Width,Length,Type of position fixing device,Draught,"
    "Destination,ETA,Data source type"
)
# Rows as the archive of the Danish Maritime Authority publishes them.
PILOT = (
    "04/11/2018 03:57:16,Class A,219012382,57.123067,8.597717,Under way using engine,0.0,0.0,,237,"
    "Unknown,OXQX2,GOLIATH VIG,Tug,,6,18,GPS,2.7,HANSTHOLM;,29/10/2019 07:00:00,AIS"
)
STATION = (
    "18/03/2023 00:00:00,Base Station,2190064,56.7166,11.519,Unknown value,,,,,Unknown,,,Undefined,"
    ",,,GPS,,,,AIS"
)
CADASTRE = (
    "mmsi,base_date_time,longitude,latitude,sog,cog,heading,vessel_name,imo,call_sign,vessel_type,"
    "status,length,width,draft,cargo,transceiver"
)


def decode(
    *lines: str, mapping: TableMapping | None = None
) -> tuple[list[PositionReport], list[StaticReport], CsvDecoder]:
    """Decode a table; return positions, statics and the decoder."""
    decoder = CsvDecoder(mapping=mapping)
    reports = list(decoder.decode(f"{line}\n" for line in lines))
    assert decoder.accounting.balances
    return (
        [report for report in reports if isinstance(report, PositionReport)],
        [report for report in reports if isinstance(report, StaticReport)],
        decoder,
    )


@pytest.mark.parametrize("has_distances", [True, False])
def test_the_danish_archive(*, has_distances: bool) -> None:
    """Its 26 and its 22 columns are read day first, its words for nothing as nothing."""
    ends = (",A,B,C,D", ",5,13,2,4", ",,,,") if has_distances else ("", "", "")
    lines = [line + end for line, end in zip((DANISH, PILOT, STATION), ends, strict=True)]
    (position,), (static,), decoder = decode(*lines)
    assert position.fix_time == datetime(2018, 11, 4, 3, 57, 16, tzinfo=UTC)
    assert (position.mmsi, position.ais_class) == (219_012_382, "A")
    assert (position.sog_kn, position.cog_deg, position.heading_deg) == (0.0, None, 237.0)
    assert (static.name, static.imo, static.ship_type) == ("GOLIATH VIG", None, 52)
    hull = hull_of(static)
    assert hull is not None
    told = (hull.to_bow_m, hull.to_stern_m, hull.to_port_m, hull.to_starboard_m)
    # The letters are those of ITU-R M.1371: C to port, D to starboard.
    assert list(told) == ([5, 13, 2, 4] if has_distances else [9, 9, 3, 3])
    assert hull.is_centred != has_distances
    assert decoder.accounting.messages.rejected == {MessageReject.MMSI_KIND: 1}
    assert propose(lines).kind == "Danish Maritime Authority"
    # The archive's own description swaps them, so whoever imports is told.
    assert bool(propose(lines).doubts) == has_distances


def test_a_real_file_of_marinecadastre(shared_dir: Path) -> None:
    """A day's beginning as published until 2023: every row has its bucket, no course is 360."""
    path = shared_dir / "real/ais/aisdb_test_data_noaa_20230101_marinecadastre.csv"
    lines = path.read_text().splitlines()
    positions, statics, decoder = decode(*lines)
    messages = decoder.accounting.messages
    assert messages.assembled == len(lines) - 1
    assert messages.positions == len(positions) > 900
    assert all(each.cog_deg is None or each.cog_deg < 360 for each in positions)
    naisha = next(each for each in statics if each.name == "MSC NAISHA III")
    assert (naisha.imo, naisha.callsign, naisha.ship_type) == (9_307_839, "5LCB4", 70)
    hull = hull_of(naisha)
    assert hull is not None
    assert hull.is_centred
    assert propose(lines[:9]).kind == "MarineCadastre"


def test_marinecadastre_from_2024_on() -> None:
    """Longitude stands before latitude there, and the time without a T."""
    row = (
        "368382440,2025-12-31 00:00:00,-76.43,36.96,4.7,321.6,327,PATRICIA B. MORAN,IMO1079618,"
        "WDP7519,52,0,26,11,5.5,,A"
    )
    (position,), (static,), _ = decode(CADASTRE, row)
    assert (position.lat_deg, position.lon_deg) == (36.96, -76.43)
    assert position.fix_time == datetime(2025, 12, 31, tzinfo=UTC)
    assert (static.to_bow_m, static.to_stern_m, static.to_starboard_m) == (0, 26, 11)


def test_a_spreadsheet_in_german() -> None:
    """Semicolons, decimal commas, date and time apart, speeds in metres a second."""
    header = "MMSI;Datum;Zeit;Breite;Länge;Geschwindigkeit (m/s);Kurs"
    row = "211000001;31.05.2024;14:00:06,5;53,54;9,98;4,5;90,1"
    mapping = propose([header, row]).mapping
    assert (mapping.delimiter, mapping.decimal) == (";", ",")
    assert mapping.speed_unit is SpeedUnit.METRES_PER_SECOND
    (position,), _, _ = decode(header, row)
    assert position.fix_time == datetime(2024, 5, 31, 14, 0, 6, 500_000, tzinfo=UTC)
    assert (position.lat_deg, position.lon_deg, position.cog_deg) == (53.54, 9.98, 90.1)
    assert position.sog_kn == pytest.approx(4.5 * 3600 / 1852)


@pytest.mark.parametrize(
    ("time", "wanted", "is_unsure"),
    [
        ("5/31/2024 2:05:06 PM", TimeFormat.MONTH_FIRST, False),
        ("31/05/2024 14:05:06", TimeFormat.DAY_FIRST, False),
        ("05/04/2024 14:05:06", TimeFormat.DAY_FIRST, True),
        ("04-May-2024 14:05:06", TimeFormat.DAY_FIRST, False),
        ("20240531140506", TimeFormat.COMPACT, False),
        ("2024/05/31 14:05:06", TimeFormat.ISO, False),
        ("1717164306", TimeFormat.ISO, False),
        ("1717164306000", TimeFormat.ISO, False),
    ],
)
def test_ways_to_write_a_time(time: str, wanted: TimeFormat, *, is_unsure: bool) -> None:
    """The way is told by the values; where they allow two, the proposal says so."""
    lines = ["mmsi,time,lat,lon", f"211000001,{time},53.5,9.98"]
    proposal = propose(lines)
    assert proposal.mapping.time_format is wanted
    assert bool(proposal.unsure_date) is is_unsure
    (position,), _, _ = decode(*lines)
    assert (position.fix_time.year, position.fix_time.minute) == (2024, 5)


def test_a_spreadsheet_that_says_its_separator() -> None:
    """Excel's first line `sep=;` is no row; a zone behind a date with the day first counts."""
    row = "211000001;31.05.2024 16:00:06 +0200;53,54;9,98"
    (position,), _, decoder = decode("\ufeffsep=;", "MMSI;Zeit;Breite;Länge", row)
    assert position.fix_time == datetime(2024, 5, 31, 14, 0, 6, tzinfo=UTC)
    assert (decoder.accounting.lines.other, decoder.accounting.lines.sentence) == (2, 1)


def test_decimal_commas_between_commas() -> None:
    """Where commas part the columns, quoted decimal commas are decimals."""
    (position,), _, _ = decode("mmsi,time,lat,lon", '211000001,2024-05-31T14:00:06Z,"53,54","9,98"')
    assert (position.lat_deg, position.lon_deg) == (53.54, 9.98)


def test_names_that_say_nothing() -> None:
    """Values tell the required columns then; the proposal says what it guessed."""
    lines = ["q,w,e,r", "2024-05-01T12:00:00Z,211000001,53.5,9.98"]
    proposal = propose(lines)
    assert proposal.mapping.columns == {"time": 0, "mmsi": 1, "lat": 2, "lon": 3}
    assert len(proposal.doubts) == 4
    assert len(decode(*lines)[0]) == 1


def test_a_mapping_somebody_gave() -> None:
    """Columns, zone and units are taken as told; the same mapping comes back from JSON."""
    mapping = TableMapping(
        {"mmsi": 3, "time": 0, "lat": 1, "lon": 2, "sog": 4},
        delimiter="|",
        timezone="Europe/Berlin",
        time_format=TimeFormat.DAY_FIRST,
        speed_unit=SpeedUnit.KILOMETRES_PER_HOUR,
    )
    assert TableMapping.of(mapping.as_dict()) == mapping
    (position,), _, _ = decode(
        "wann|hoch|quer|wer|v", "1.7.2024 14:00|53.5|9.98|211000001|18.52", mapping=mapping
    )
    assert position.fix_time == datetime(2024, 7, 1, 12, tzinfo=UTC)
    assert position.sog_kn == pytest.approx(10)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"columns": {"mmsi": 0, "time": 1, "lat": 2}}, "columns"),
        ({"columns": {"mmsi": 0, "time": 1, "lat": 2, "lon": -1}}, "columns"),
        ({"columns": {"mmsi": 0, "time": 1, "lat": 2, "lon": 3, "colour": 4}}, "columns"),
        ({"columns": [1]}, "columns"),
        ({"delimiter": "x"}, "delimiter"),
        ({"decimal": "'"}, "decimal"),
        ({"time_format": "soon"}, "time_format"),
        ({"timezone": "../etc/passwd"}, "timezone"),
        ({"speed_unit": 3}, "speed_unit"),
        ({"has_header": "yes"}, "has_header"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_a_mapping_that_cannot_be(change: dict[str, object], field: str) -> None:
    """What no table can be read by is refused, naming the field."""
    good = TableMapping({"mmsi": 0, "time": 1, "lat": 2, "lon": 3}).as_dict()
    with pytest.raises(MappingError) as refused:
        TableMapping.of(good | change)
    assert refused.value.field == field


@given(
    st.lists(
        st.sampled_from([PILOT, STATION, PILOT.replace("04/11", "99/11"), PILOT[:90]])
        | st.text(max_size=40),
        max_size=20,
    ),
    st.none() | st.dictionaries(st.sampled_from(FIELDS), st.integers(0, 30)),
)
def test_every_bad_row_is_told_and_counted(
    lines: list[str], columns: dict[str, int] | None
) -> None:
    """Whatever the rows and the mapping, nothing breaks, each sum is exact, each reject is told."""
    told: list[Reject] = []
    mapping = None if columns is None else TableMapping(columns)
    decoder = CsvDecoder(mapping=mapping, rejects=RejectLog(told.append))
    list(decoder.decode(f"{line}\n" for line in [DANISH, *lines]))
    assert decoder.accounting.balances
    assert decoder.accounting.lines.total == len(lines) + 1
    assert len(told) == decoder.accounting.messages.rejected.total()
