"""What is hard to believe of positions, given a vessel's other reports."""

import gzip
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.ais import FixTimeSource, PositionReport
from app.domain.local_metres import moved
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.plausibility import Doubt, doubts, receiver_clock_is_off, within_reach

NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)
REPORT = PositionReport(
    211_000_001, NOON, NOON, 53.54, 9.98, 10.0, 90.0, 90.0, 0.0, 1, "A", high_accuracy=True
)


def track(*east_m: float, every_s: float = 10.0) -> list[PositionReport]:
    """Return reports of one vessel at so many metres east of a place, one after the other."""
    reports = []
    for index, metres in enumerate(east_m):
        lat_deg, lon_deg = moved(53.54, 9.98, metres, 0.0)
        moment = NOON + timedelta(seconds=every_s * index)
        reports.append(replace(REPORT, fix_time=moment, lat_deg=lat_deg, lon_deg=lon_deg))
    return reports


def of_track(reports: Sequence[PositionReport]) -> list[list[Doubt]]:
    """Return the doubts of each report, given its neighbours."""
    return [
        doubts(report, reports[max(0, index - 2) : index], reports[index + 1 : index + 3])
        for index, report in enumerate(reports)
    ]


@pytest.mark.parametrize(
    ("east_m", "expected"),
    [
        ((0, 50, 100, 150, 200), "....."),
        ((0, 50, 9000, 150, 200), "..J.."),  # one report jumps there and back
        ((0, 50, 100, 9000, 9050, 9100), "..JJ.."),  # and stays: either side may be wrong
        ((0, 9000, 50, 9050, 100, 9100), ".TTTT."),  # two vessels under one MMSI
        ((0, 9000), "JJ"),
        ((0, 50, 400, 150, 200), "..J.."),  # a poor fix is no second place
    ],
)
def test_jumps_and_two_places_are_told_apart(east_m: tuple[float, ...], expected: str) -> None:
    """A report away from all others jumped; reports from two places in turn are of two vessels."""
    names = {(): ".", (Doubt.JUMP,): "J", (Doubt.TWO_PLACES,): "T"}
    assert "".join(names[tuple(found)] for found in of_track(track(*east_m))) == expected


def test_another_side_of_the_world_is_far_away() -> None:
    """Nothing is heard from 1,000 km away, and 0 N 0 E is a receiver without a fix."""
    assert doubts(REPORT, [], [], site=(53.5, 9.9)) == []
    assert doubts(REPORT, [], [], site=(-33.0, 151.0)) == [Doubt.FAR_AWAY]
    assert doubts(replace(REPORT, lat_deg=0.0, lon_deg=0.0), [], []) == [Doubt.FAR_AWAY]
    over_the_date_line = replace(REPORT, lat_deg=0.1, lon_deg=179.99)
    assert doubts(over_the_date_line, [], [], site=(0.1, -179.99)) == []


def test_a_wrong_clock_of_the_receiver_is_told_from_a_vessels() -> None:
    """When most vessels' seconds contradict their reception, it is the receiver that is wrong."""
    wrong = {"fix_time_source": FixTimeSource.DOUBTFUL}
    fleet = [replace(REPORT, mmsi=211_000_000 + index) for index in range(10)]
    assert doubts(replace(REPORT, fix_time_source=FixTimeSource.DOUBTFUL), [], []) == [
        Doubt.DOUBTFUL_TIME
    ]
    assert not receiver_clock_is_off([replace(fleet[0], **wrong), *fleet[1:]])
    assert receiver_clock_is_off([*fleet[:3], *(replace(ship, **wrong) for ship in fleet[3:])])
    assert not receiver_clock_is_off([replace(fleet[0], **wrong)])


@given(
    speeds=st.tuples(st.floats(0, 40), st.floats(0, 40)),
    seconds=st.floats(0, 3600),
    share=st.floats(0, 1),
)
def test_what_a_vessel_can_do_is_never_doubted(
    speeds: tuple[float, float], seconds: float, share: float
) -> None:
    """Way made at any speed up to the faster of two reports is within reach."""
    way_m = share * max(speeds) * 1852 / 3600 * seconds
    first, second = track(0, way_m, every_s=seconds)
    assert within_reach(replace(first, sog_kn=speeds[0]), replace(second, sog_kn=speeds[1]))


def test_real_traffic_is_seldom_doubted(shared_dir: Path) -> None:
    """Of 24,656 real positions one jumped, a ferry's poor fix 200 m aside; all were kept."""
    data = (shared_dir / "real/ais/dma_5min_2013-11-12_pghp.nmea.gz").read_bytes()
    by_vessel: dict[int, list[PositionReport]] = defaultdict(list)
    for report in decode_lines(gzip.decompress(data).splitlines(), NmeaDecoder()):
        if isinstance(report, PositionReport):
            by_vessel[report.mmsi].append(report)
    counts: Counter[Doubt] = Counter()
    for reports in by_vessel.values():
        reports.sort(key=lambda report: report.fix_time)
        counts.update(doubt for found in of_track(reports) for doubt in found)
    assert counts == {Doubt.DOUBTFUL_TIME: 2106, Doubt.JUMP: 1}
