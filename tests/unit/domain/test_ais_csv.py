"""Plain tables of positions."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.accounting import MessageReject
from app.domain.ais import FixTimeSource, PositionReport, StaticReport
from app.domain.ais_csv import COLUMNS, CsvDecoder, CsvHeaderError

HEADER = ",".join(COLUMNS)
NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)
FULL = "211000001,2024-05-01T12:00:00Z,53.5,9.98,9.7,112.5,113,-3.5,8,11,4,3,ELBE 3,70"


def decode(*lines: str) -> tuple[list[PositionReport | StaticReport], CsvDecoder]:
    """Decode a table given by its lines."""
    decoder = CsvDecoder()
    return list(decoder.decode(f"{line}\n" for line in lines)), decoder


def test_a_full_row_gives_position_and_statics() -> None:
    """All columns of the contract arrive, with their units, and nothing is made up."""
    reports, decoder = decode(HEADER, FULL)
    assert reports == [
        PositionReport(
            211_000_001,
            NOON,
            NOON,
            53.5,
            9.98,
            9.7,
            112.5,
            113.0,
            -3.5,
            0,
            None,
            None,
            FixTimeSource.STATED,
        ),
        StaticReport(211_000_001, NOON, "ELBE 3", None, None, 70, 8.0, 11.0, 4.0, 3.0),
    ]
    counts = decoder.accounting
    assert (counts.lines.sentence, counts.lines.other) == (1, 1)
    assert (counts.sentences.total, counts.messages.assembled, counts.messages.positions) == (
        1,
        1,
        1,
    )
    assert counts.balances


def test_columns_go_by_their_names() -> None:
    """Columns in another order, in capitals, with spaces and among strangers are understood."""
    reports, _ = decode(
        "\ufeffTime, LAT,lon,Status,COG,sog,MMSI", "1714564800,53.5,9.98,moored,112.5,9.7,211000001"
    )
    assert isinstance(reports[0], PositionReport)
    assert (reports[0].sog_kn, reports[0].cog_deg) == (9.7, 112.5)
    assert reports[0].fix_time == NOON
    assert len(reports) == 1


def test_a_table_without_a_header_has_the_order_of_the_contract() -> None:
    """A first row that begins with an MMSI is data."""
    reports, decoder = decode(FULL)
    assert len(reports) == 2
    assert decoder.accounting.lines.total == 1


@pytest.mark.parametrize("header", ["mmsi,time,lat", "a,b,c", "time;mmsi;lat;lon"])
def test_a_table_that_lacks_a_column_is_refused(header: str) -> None:
    """Without MMSI, time and place there is no position: the missing columns are named."""
    with pytest.raises(CsvHeaderError, match="lon"):
        decode(header, FULL)


@pytest.mark.parametrize(
    ("row", "reason", "column"),
    [
        ("x,2024-05-01T12:00:00Z,53.5,9.98,,", MessageReject.FIELD, "mmsi"),
        (",2024-05-01T12:00:00Z,53.5,9.98,,", MessageReject.MMSI_KIND, "mmsi"),
        ("992190917,2024-05-01T12:00:00Z,53.5,9.98,,", MessageReject.MMSI_KIND, "mmsi"),
        ("211000001.5,2024-05-01T12:00:00Z,53.5,9.98,,", MessageReject.FIELD, "mmsi"),
        ("211000001,yesterday,53.5,9.98,,", MessageReject.TIME, "time"),
        ("211000001,,53.5,9.98,,", MessageReject.TIME, "time"),
        ("211000001,0001-01-01T00:00:00+14:00,53.5,9.98,,", MessageReject.TIME, "time"),
        ("211000001,2024-05-01T12:00:00Z,91,9.98,,", MessageReject.POSITION, "lat"),
        ("211000001,2024-05-01T12:00:00Z,53.5,181,,", MessageReject.POSITION, "lon"),
        ("211000001,2024-05-01T12:00:00Z,53.5,,,", MessageReject.POSITION, "lon"),
        ("211000001,2024-05-01T12:00:00Z,north,9.98,,", MessageReject.FIELD, "lat"),
        ("211000001,2024-05-01T12:00:00Z,nan,9.98,,", MessageReject.POSITION, "lat"),
        ("211000001,2024-05-01T12:00:00Z,53.5,9.98,fast,", MessageReject.FIELD, "sog"),
        ("211000001,2024-05-01T12:00:00Z,53.5,9.98,1e999,", MessageReject.FIELD, "sog"),
        ("211000001,2024-05-01T12:00:00Z,53.5,9.98,1,1,1,1,-8", MessageReject.FIELD, "to_bow"),
        ("211000001,2024-05-01T12:00:00Z", MessageReject.POSITION, "lat"),
    ],
)
def test_a_bad_row_is_named_and_costs_only_itself(
    row: str, reason: MessageReject, column: str
) -> None:
    """A bad row is rejected with its line, bucket and column; its neighbours are taken."""
    reports, decoder = decode(HEADER, row, FULL)
    (error,) = decoder.errors
    assert (error.line, error.reason, error.column) == (2, reason, column)
    assert decoder.accounting.messages.rejected == {reason: 1}
    assert len(reports) == 2
    assert decoder.accounting.balances


def test_not_available_values_of_ais_are_understood_in_tables() -> None:
    """102.3 kn, course 360 and heading 511 are gaps in a table too."""
    reports, _ = decode("211000001,1714564800,53.5,9.98,102.3,360,511")
    assert isinstance(reports[0], PositionReport)
    assert (reports[0].sog_kn, reports[0].cog_deg, reports[0].heading_deg) == (None, None, None)


def test_repeated_rows_are_duplicates_and_statics_come_once() -> None:
    """The same row again is a duplicate; unchanged statics are not repeated in every row."""
    later = FULL.replace("12:00:00", "12:00:10")
    reports, decoder = decode(HEADER, FULL, FULL, later)
    assert decoder.accounting.messages.positions == 2
    assert decoder.accounting.messages.duplicates == 1
    assert [type(report) for report in reports] == [PositionReport, StaticReport, PositionReport]


def test_changed_statics_are_told() -> None:
    """A vessel that changes its name in a later row gives new statics."""
    later = FULL.replace("12:00:00", "12:00:10").replace("ELBE 3", "ELBE 4")
    reports, _ = decode(HEADER, FULL, later)
    assert [r.name for r in reports if isinstance(r, StaticReport)] == ["ELBE 3", "ELBE 4"]


def test_script_and_formula_in_a_name_stay_text() -> None:
    """A name with quotes, commas, tags or a formula is kept exactly."""
    reports, _ = decode(HEADER, FULL.replace("ELBE 3", '"=1+1, <b>""X"""'))
    assert isinstance(reports[1], StaticReport)
    assert reports[1].name == '=1+1, <b>"X"'


def test_a_stray_quote_costs_no_other_row() -> None:
    """A quote that is never closed does not swallow the rows after it."""
    reports, decoder = decode(HEADER, FULL.replace("ELBE 3", '"ELBE 3'), FULL, "x" * 5000)
    assert decoder.accounting.messages.assembled == 2
    assert len([r for r in reports if isinstance(r, PositionReport)]) == 2
    assert [(error.line, error.column) for error in decoder.errors] == [(4, "row")]


def test_stone_soup_recording(shared_dir: Path) -> None:
    """A recording whose header has other names is read once these are ours; all rows count."""
    lines = (
        (shared_dir / "real/ais/stonesoup_SolentAIS_20160112_130211.csv").read_text().splitlines()
    )
    reports, decoder = decode("time,mmsi,lat,lon,cog,sog", *lines[1:])
    counts = decoder.accounting
    assert counts.lines.sentence == len(lines) - 1 == 18623
    assert counts.balances
    kept = counts.messages.positions + counts.messages.duplicates
    rejected = [line for line in lines[1:] if line.split(",")[1][0] not in "234567"]
    assert counts.messages.rejected.total() == len(rejected)
    assert kept == 18623 - len(rejected)
    assert len(reports) == counts.messages.positions


@given(st.lists(st.text(max_size=60), max_size=20))
def test_the_sums_are_exact_for_any_table(lines: list[str]) -> None:
    """No text breaks the reader, and each row it finds has one bucket."""
    decoder = CsvDecoder()
    try:
        list(decoder.decode([FULL + "\n", *(line + "\n" for line in lines)]))
    except CsvHeaderError:
        pytest.fail("a table that began with data has no header")
    assert decoder.accounting.balances
