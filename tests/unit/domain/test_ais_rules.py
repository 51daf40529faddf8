"""The twelve rules of what AIS means, by number, each on messages that were really sent.

The sentences are from the public recordings; where these have no example, the sender is pyais and
the values are those of ITU-R M.1371-5. Finer points of a rule are tested beside its code.
"""

import gzip
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from statistics import median

import pytest

from app.domain.ais import FixTimeSource, PositionReport, StaticReport
from app.domain.candidates import UnmatchedReason
from app.domain.fusion import FusionSettings, fuse
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.plausibility import Doubt, doubts
from app.domain.tracks import NoState, TrackMethod, TrackSettings, state_at
from app.domain.vessel_state import HeadingSource, StateFlag, VesselState
from app.domain.vessel_statics import Hull, hull_at, statics_at
from app.simulation.roadstead import FRAME, make_roadstead
from tests.factories.nmea_text import encoded, tag_block

NOON = datetime(2013, 11, 12, 12, 0, 2, tzinfo=UTC)
HERMITE = TrackSettings(TrackMethod.HERMITE)
Reports = list[PositionReport | StaticReport]


def heard(*sentences: str, at: datetime = NOON) -> Reports:
    """Decode sentences as received at one moment."""
    tag = tag_block(f"c:{int(at.timestamp())}")
    return list(decode_lines([tag + sentence for sentence in sentences], NmeaDecoder()))


def position(sentence: str, at: datetime = NOON) -> PositionReport:
    """Decode the position report in a sentence."""
    (report,) = heard(sentence, at=at)
    assert isinstance(report, PositionReport)
    return report


def static(*sentences: str, at: datetime = NOON) -> StaticReport:
    """Decode the static report in one or two sentences."""
    (report,) = heard(*sentences, at=at)
    assert isinstance(report, StaticReport)
    return report


def state(
    reports: Sequence[PositionReport], statics: Sequence[StaticReport], at: datetime = NOON
) -> VesselState:
    """Return the state at a moment, which must exist."""
    found = state_at(reports, statics, at, HERMITE)
    assert isinstance(found, VesselState)
    return found


@cache
def five_minutes(shared_dir: Path) -> Reports:
    """Decode five minutes of Danish traffic."""
    data = (shared_dir / "real/ais/dma_5min_2013-11-12_pghp.nmea.gz").read_bytes()
    return list(decode_lines(gzip.decompress(data).splitlines(), NmeaDecoder()))


CLASS_A = "!BSVDM,1,1,,A,13uwg<03i@PqurHP0Mu=`bql0d12,0*0D"
CLASS_A_3 = "!BSVDM,1,1,,B,339gjn0OkF0fqPVO:2BjdBP000Qh,0*05"
CLASS_B = "!BSVDM,1,1,,A,B3@o;g0090<U4O7n1nu;OwW5oP06,0*0D"
BASE_STATION = "!BSVDM,1,1,,A,402R3bQunn;ss0s>KfPOeUQ0080:,0*09"
AIRCRAFT = "!AIVDM,1,1,,B,91b55uOwww<tSF0l4Q@>4?h20h@B,0*13"
BUOY = "!BSVDM,1,1,,A,E>j>R:RT0b:2a@10a7000000000@Hk<j?wCCp10888uP20,4*75"
LONG_RANGE = "!AIVDM,1,1,,A,KvQ:1o`7EBrBQ`?w,0*37"
MOORED_AT_11_KN = "!BSVDM,1,1,,B,13mMR:501k0WrT6Q6DR3`Bv2280I,0*09"


def test_rule_1_positions_come_from_types_1_2_3_18_and_19_alone() -> None:
    """Base stations, aircraft, buoys and long-range reports are no vessel's positions."""
    assert (position(CLASS_A).message_type, position(CLASS_A_3).message_type) == (1, 3)
    assert (position(CLASS_B).message_type, position(CLASS_B).ais_class) == (18, "B")
    extended = encoded({"msg_type": 19, "mmsi": 211_000_001, "lat": 53.5, "lon": 9.9})[0]
    assert [type(report) for report in heard(extended)] == [PositionReport, StaticReport]
    assert heard(BASE_STATION, AIRCRAFT, BUOY, LONG_RANGE) == []


def test_rule_2_values_that_mean_not_available_are_no_measurements() -> None:
    """91 N 181 E is no place; 102.3 kn, 360 degrees, heading 511 and turn -128 are nothing."""
    assert heard("!BSVDM,1,1,,A,13A;Td0P?w<tSF0l4Q@>4?wv0p8v,0*41") == []
    silent = position("!BSVDM,1,1,,A,13Ad>R5P?w0eBT8P`BPf4?wl05P0,0*13")
    assert (silent.sog_kn, silent.cog_deg, silent.heading_deg, silent.rot_deg_min) == (None,) * 4
    assert (silent.lat_deg, silent.lon_deg) == pytest.approx((57.024217, 9.893767), abs=1e-6)


def test_rule_3_rates_of_turn_are_signed_squares() -> None:
    """Raw 15 is 10 deg/min to starboard, raw -16 is 11 to port; 127 tells a side but no rate."""
    assert position(CLASS_A).rot_deg_min == pytest.approx((15 / 4.733) ** 2)
    to_port = "!BSVDM,1,1,,A,181:JmPt2L0SJChPJW00vPp2080?,0*6C"
    assert position(to_port).rot_deg_min == pytest.approx(-((16 / 4.733) ** 2))
    assert position(CLASS_A_3).rot_deg_min is None


def test_rule_4_a_fix_is_of_its_own_second(shared_dir: Path) -> None:
    """The second nearest to reception counts if it lies -2 to +5 s away; else reception does."""
    prompt = position(CLASS_A, at=NOON)  # second 58
    assert (prompt.fix_time, prompt.fix_time_source) == (
        NOON - timedelta(seconds=4),
        FixTimeSource.PROMPT,
    )
    late = position(CLASS_A, at=NOON + timedelta(seconds=20))
    assert (late.fix_time, late.fix_time_source) == (late.received_at, FixTimeSource.DOUBTFUL)
    none = position("!BSVDM,1,1,,A,33c>DT0PBl0mq2TO8oWSuBop0PSi,0*18")  # second 60, 18 kn
    assert (none.fix_time, none.fix_time_source) == (NOON, FixTimeSource.RECEIVED)
    spread = state([none], []).position_covariance_m2
    assert spread[0] + spread[2] > 200 + (2 * 18 * 1852 / 3600) ** 2 - 1  # 10 m, and 2 s of way
    lags_s = [
        (report.received_at - report.fix_time).total_seconds()
        for report in five_minutes(shared_dir)
        if isinstance(report, PositionReport) and report.fix_time_source is FixTimeSource.PROMPT
    ]
    assert median(lags_s) == pytest.approx(0.5, abs=0.15)


def test_rule_5_repeats_are_dropped_and_reports_taken_in_order_of_fixes(shared_dir: Path) -> None:
    """Of two recordings of one vessel two thirds are repeats; the order of lines does not count."""
    for name, positions, duplicates in (
        ("dma_212123000_14h_pghp.ais", 901, 2078),
        ("dma_219165000_22min_pghp_and_suffix.ais", 20, 44),
    ):
        lines = (shared_dir / "real/ais" / name).read_bytes().splitlines()
        decoder = NmeaDecoder()
        reports = [r for r in decode_lines(lines, decoder) if isinstance(r, PositionReport)]
        counted = decoder.accounting.messages
        assert (counted.positions, counted.duplicates) == (positions, duplicates)
        moments = sorted(report.fix_time for report in reports)
        between = moments[9] + (moments[10] - moments[9]) / 2
        assert state_at(reports, [], between, HERMITE) == state_at(
            reports[::-1], [], between, HERMITE
        )


def test_rule_6_a_heading_says_where_it_is_from(shared_dir: Path) -> None:
    """A reported heading, else the course under way, else none; the shares are those of traffic."""
    assert state([position(CLASS_A)], []).heading_source is HeadingSource.REPORTED
    at = NOON + timedelta(seconds=13)
    slow = state([position(CLASS_B, at=at)], [], at)  # 3.6 kn
    assert (slow.heading_deg, slow.heading_source) == (120.7, HeadingSource.COURSE)
    assert slow.heading_sigma_deg == 15.0
    fast = "!BSVDM,1,1,,B,13@oA>PP2<PnEnRO?:nrqgv200Si,0*19"  # class A at 14 kn
    by_course = state([position(fast)], [])
    assert (by_course.heading_source, by_course.heading_sigma_deg) == (HeadingSource.COURSE, 7.0)
    assert StateFlag.HEADING_NOT_REPORTED in by_course.flags
    silent = position("!BSVDM,1,1,,A,13Ad>R5P?w0eBT8P`BPf4?wl05P0,0*13")
    after_it = position("!BSVDM,1,1,,A,33Ad>R5P?w0eBRpP`BUf4?wl006k,0*62", NOON)
    assert state_at([silent, after_it], [], NOON, HERMITE) in set(NoState)
    reports = [r for r in five_minutes(shared_dir) if isinstance(r, PositionReport)]
    for ais_class, expected in (("A", 0.13), ("B", 0.99)):
        of_class = [r.heading_deg is None for r in reports if r.ais_class == ais_class]
        assert sum(of_class) / len(of_class) == pytest.approx(expected, abs=0.02)


NO_SIZE = (
    "!BSVDM,2,1,9,A,53@oFCD00001Q3WSKL10ThuB0I8D@E8T<T40000000000t0Ht0000000,0*4F",
    "!BSVDM,2,2,9,A,000000000000000,2*34",
)
MURMANSK = (
    "!ABVDM,2,1,3,A,53eIfL01sookTQMGH00mE8l4q<d000000000001602k0L5Um0@Dm841E1DTh,0*65",
    "!ABVDM,2,2,3,A,UDQh0000000,2*04",
)


def test_rule_7_sizes_are_known_in_part_or_not_at_all() -> None:
    """All 0 is a place without a box; A = C = 0 an antenna anywhere; 511 m means "at least"."""
    at_sea = make_roadstead(0)
    ship = at_sea.ships[0]
    nowhere = state([position(CLASS_A)], [static(*NO_SIZE)])
    assert nowhere.flags == (StateFlag.NO_SIZE,)
    there = VesselState("1", ship.state.lat_deg, ship.state.lon_deg, 0, 0, 0, 0, 0, 0, 0)
    result = fuse(
        at_sea.camera, FRAME, 0.0, [ship.detection], [there], FusionSettings(maximum_cost=9)
    )
    assert result.unmatched_states == {0: UnmatchedReason.SIZE_UNKNOWN}

    centred = state([position(CLASS_A)], [static(*MURMANSK)])
    assert (centred.to_bow_m, centred.to_port_m) == (179 / 2, 28 / 2)
    assert centred.flags == (StateFlag.ANTENNA_UNKNOWN,)
    assert centred.position_sigma_m > 60
    on_the_stem = static("!BSVDM,1,1,,A,H3uGtD4TDBE5847C5joqn00`5030,0*61")
    known = hull_at([on_the_stem], NOON)
    assert known is not None
    assert known.hull == Hull(5, 5, 0, 3)
    huge = {"msg_type": 5, "mmsi": 211_000_001, "to_bow": 511, "to_stern": 20, "to_port": 30}
    largest = state([position(CLASS_A)], [static(*encoded({**huge, "to_starboard": 30}))])
    assert largest.flags == (StateFlag.SIZE_AT_LEAST,)


def test_rule_8_statics_are_the_latest_of_each_field() -> None:
    """What was said only after the image is used, and flagged."""
    later = static(*MURMANSK, at=NOON + timedelta(seconds=90))
    assert StateFlag.LATER_SIZE in state([position(CLASS_A)], [later]).flags
    named = StaticReport(1, NOON, "OLD", None, None, None, None, None, None, None)
    known = statics_at([named, later], NOON + timedelta(seconds=10))
    assert (known.name, known.is_later) == ("OLD", True)


def test_rule_9_navigational_status_gates_nothing() -> None:
    """A ship that says "moored" and makes 11.5 kn is moved along its course like any other."""
    moored = position(MOORED_AT_11_KN)
    ten_later = state([moored], [], moored.fix_time + timedelta(seconds=10))
    assert ten_later.speed_kn == 11.5
    assert ten_later.lon_deg > moored.lon_deg + 0.0009  # 59 m east


def test_rule_10_only_vessels_are_vessels(shared_dir: Path) -> None:
    """Coast stations, aircraft, buoys and their like are refused; a tender names its ship."""
    base_station = "!AIVDO,1,1,,,1000dO0P010f0HvPa9eW8gwB0000,0*26"
    aircraft = "!AIVDM,1,1,,A,11aucisP010vKO2NwR88ugvP20RA,0*27"
    light = "!AIVDO,1,1,,,1>kBm<AP00K5=7Lcj7707OvH05Jp,0*7B"
    assert heard(base_station, aircraft, light) == []
    stream = (shared_dir / "real/ais/dma_aislib_stream_29s_pghp.txt").read_bytes().splitlines()
    mmsis = [report.mmsi for report in decode_lines(stream, NmeaDecoder())]
    assert all(200_000_000 <= mmsi < 800_000_000 for mmsi in mmsis)
    tender = {"msg_type": 24, "mmsi": 982_110_001, "partno": 1, "ship_type": 50}
    mother = static(*encoded({**tender, "mothership_mmsi": 211_000_001}))
    assert (mother.mothership_mmsi, mother.to_bow_m) == (211_000_001, None)
    afloat = encoded(
        {"msg_type": 18, "mmsi": 982_110_001, "lat": 53.5, "speed": 6.0, "heading": 511}
    )
    boat = state([position(afloat[0])], [mother])
    assert boat.flags == (
        StateFlag.HEADING_NOT_REPORTED,
        StateFlag.NO_SIZE,
        StateFlag.AUXILIARY_CRAFT,
    )


def test_rule_11_names_have_no_padding_and_fixes_their_accuracy() -> None:
    """`@` and blanks around a name go; the accuracy flag halves a position's sigma."""
    assert static(*NO_SIZE).name == "PILOT FREDERICIA"
    assert static(*MURMANSK).name == "MURMANSK"
    assert (position(CLASS_A).position_sigma_m, position(CLASS_B).position_sigma_m) == (5.0, 10.0)


def test_rule_12_what_is_hard_to_believe_is_flagged_and_kept(shared_dir: Path) -> None:
    """A lighthouse tender's 102.2 kn stays a report, with its doubt; its neighbours have none."""
    path = shared_dir / "real/ais/dma_219165000_22min_pghp_and_suffix.ais"
    track = sorted(
        (
            report
            for report in decode_lines(path.read_bytes().splitlines(), NmeaDecoder())
            if isinstance(report, PositionReport)
        ),
        key=lambda report: report.fix_time,
    )
    found = {
        index: doubts(report, track[max(0, index - 2) : index], track[index + 1 : index + 3])
        for index, report in enumerate(track)
    }
    (doubtful,) = [i for i, of_report in found.items() if Doubt.IMPOSSIBLE_SPEED in of_report]
    assert track[doubtful].sog_kn == 102.2
    assert found[doubtful - 1] == found[doubtful + 1] == []
    there = state(track, [], track[doubtful].fix_time)
    assert Doubt.IMPOSSIBLE_SPEED in there.flags
