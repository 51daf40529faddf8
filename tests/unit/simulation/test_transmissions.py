"""The AIS recording, read back with pyais."""

from collections import defaultdict
from datetime import UTC, datetime

import numpy as np
import pytest
from pyais import decode
from pyais.messages import ANY_MESSAGE

from app.simulation.harbour import Harbour
from app.simulation.transmissions import Transmission, reporting_interval_s
from app.simulation.vessels import Vessel

_KNOT_M_S = 1852 / 3600


def _decoded(transmission: Transmission) -> ANY_MESSAGE:
    return decode(*(line.split("\\")[2] for line in transmission.lines))


def _first_copies(harbour: Harbour) -> list[Transmission]:
    """Messages once each, though two stations may have heard them."""
    seen, kept = set(), []
    for transmission in harbour.transmissions:
        key = (transmission.made_at, tuple(line.split("\\")[2] for line in transmission.lines))
        if key not in seen:
            seen.add(key)
            kept.append(transmission)
    return kept


def _vessel(harbour: Harbour, mmsi: int) -> Vessel:
    return next(v for v in harbour.vessels if v.mmsi == mmsi)


def _antenna_offset_m(harbour: Harbour, transmission: Transmission) -> np.ndarray:
    """Where the message says the antenna is, from where it truly was; vessel axes, metres."""
    message = _decoded(transmission)
    vessel = _vessel(harbour, transmission.mmsi)
    unit = vessel.transponder
    assert unit is not None
    motion = vessel.passage.at((transmission.made_at - harbour.start).total_seconds())
    level = harbour.site.water_level_m
    reported = harbour.frame.position(message.lat, message.lon, level)[:2]
    offset = reported - (motion.east_m, motion.north_m)
    a = np.radians(motion.heading_deg)
    forward, port = np.array([np.sin(a), np.cos(a)]), np.array([-np.cos(a), np.sin(a)])
    return np.array([offset @ forward - unit.antenna_ahead_m, offset @ port - unit.antenna_port_m])


def test_mmsis_are_unique_and_vessels_many(harbour: Harbour) -> None:
    """No two vessels share an MMSI, and some carry none."""
    mmsis = [v.mmsi for v in harbour.vessels if v.mmsi is not None]
    assert len(set(mmsis)) == len(mmsis)
    assert len(mmsis) >= 8
    assert len(mmsis) < len(harbour.vessels)


def test_every_line_has_a_tag_block_with_a_true_checksum(harbour: Harbour) -> None:
    """Tag blocks carry the arrival time and verify."""
    for transmission in harbour.transmissions:
        for line in transmission.lines:
            _, tag, sentence = line.split("\\")
            content, given = tag.split("*")
            checksum = 0
            for byte in content.encode():
                checksum ^= byte
            assert checksum == int(given, 16)
            assert sentence.startswith("!AIVDM,")
            stamp = int(content.split("c:")[1])
            assert stamp == int(transmission.heard_at.timestamp())
    heard = [t.heard_at for t in harbour.transmissions]
    assert heard == sorted(heard)


def test_perfect_reports_say_the_truth_to_their_resolution(perfect_harbour: Harbour) -> None:
    """Without noise a position is true to the message's 0.0001 minutes, and never late."""
    for transmission in perfect_harbour.transmissions:
        lag = (transmission.heard_at - transmission.made_at).total_seconds()
        assert 0 <= lag < 1
        if transmission.kind == "static":
            continue
        assert (
            np.abs(_antenna_offset_m(perfect_harbour, transmission)).max()
            < 0.17  # half a grid cell; pyais rounds
        )  # half a grid cell's diagonal
        message = _decoded(transmission)
        motion = _vessel(perfect_harbour, transmission.mmsi).passage.at(
            (transmission.made_at - perfect_harbour.start).total_seconds()
        )
        assert message.second == transmission.made_at.second
        assert message.speed == pytest.approx(motion.speed_m_s / _KNOT_M_S, abs=0.051)
        assert (message.heading - motion.heading_deg + 180) % 360 - 180 == pytest.approx(
            0, abs=0.51
        )
        assert (message.course - motion.course_deg + 180) % 360 - 180 == pytest.approx(0, abs=0.06)


def test_noise_is_as_large_as_the_settings_say(harbour: Harbour) -> None:
    """Positions scatter by bias and noise together, and most are off by more than the grid."""
    offsets = np.array(
        [_antenna_offset_m(harbour, t) for t in _first_copies(harbour) if t.kind == "position"]
    )
    traffic = harbour.settings.traffic
    expected = np.hypot(traffic.bias_sigma_m, traffic.position_sigma_m)
    assert len(offsets) > 300
    assert 0.6 * expected < offsets.std() < 1.5 * expected


def test_statics_carry_size_and_name(perfect_harbour: Harbour) -> None:
    """Class A sends message 5 in two sentences, class B 24A and 24B, each with the true size."""
    kinds = defaultdict(set)
    for transmission in perfect_harbour.transmissions:
        if transmission.kind != "static":
            continue
        message = _decoded(transmission)
        vessel = _vessel(perfect_harbour, transmission.mmsi)
        kinds[message.msg_type].add(getattr(message, "partno", None))
        if message.msg_type == 5:
            assert len(transmission.lines) == 2
            assert message.shipname == vessel.name
        if message.msg_type == 5 or message.partno == 1:
            assert message.to_bow + message.to_stern == vessel.ship.length_m
            assert message.to_port + message.to_starboard == vessel.ship.width_m
    assert kinds == {5: {None}, 24: {0, 1}}


def test_every_vessel_with_ais_is_heard_before_the_first_image(perfect_harbour: Harbour) -> None:
    """Statics and positions of a session's vessels precede its images."""
    for session in perfect_harbour.sessions:
        first = min(f.captured_at for f in perfect_harbour.frames if f.session is session)
        for vessel in session.vessels:
            kinds = {t.kind for t in perfect_harbour.transmissions
                     if t.mmsi == vessel.mmsi and t.heard_at < first}  # fmt: skip
            assert kinds == {"position", "static"}


def test_reports_come_at_the_intervals_of_the_standard(perfect_harbour: Harbour) -> None:
    """Between two position reports lies the interval of the class and speed, to a second."""
    by_vessel = defaultdict(list)
    for transmission in perfect_harbour.transmissions:
        if transmission.kind == "position":
            by_vessel[transmission.mmsi].append(transmission.made_at)
    usual = defaultdict(set)
    for mmsi, times in by_vessel.items():
        vessel = _vessel(perfect_harbour, mmsi)
        assert vessel.transponder is not None
        gaps = np.diff([t.timestamp() for t in times])
        if len(gaps):
            usual[vessel.transponder.ais_class, vessel.moored].add(round(float(np.median(gaps))))
    assert usual["A", False] == {10}
    assert usual["A", True] <= {180}
    assert usual["B", False] == {30}


@pytest.mark.parametrize(
    ("ais_class", "speed_kn", "moored", "turning", "interval_s"),
    [
        ("A", 0.1, True, False, 180.0),
        ("A", 4.0, True, False, 10.0),
        ("A", 8.0, False, False, 10.0),
        ("A", 8.0, False, True, 10 / 3),
        ("A", 18.0, False, False, 6.0),
        ("A", 18.0, False, True, 2.0),
        ("A", 25.0, False, False, 2.0),
        ("B", 1.0, False, False, 180.0),
        ("B", 5.0, False, True, 30.0),
    ],
)
def test_the_table_of_intervals(
    *, ais_class: str, speed_kn: float, moored: bool, turning: bool, interval_s: float
) -> None:
    """ITU-R M.1371-5, tables 1 and 2."""
    assert ais_class in {"A", "B"}
    assert reporting_interval_s(
        "A" if ais_class == "A" else "B", speed_kn, moored=moored, turning=turning
    ) == pytest.approx(interval_s)


def test_times_relate_to_the_start(harbour: Harbour) -> None:
    """The recording lies within the sessions' days."""
    assert harbour.start == datetime(2026, 5, 12, 6, 10, tzinfo=UTC)
    assert abs((harbour.transmissions[0].heard_at - harbour.start).total_seconds()) < 900
