"""What the receiver hears: AIS messages as NMEA text with their time of arrival.

Each vessel reports at the intervals the standard gives its class, speed and turning. A report
holds the antenna's place at a whole UTC second; noise, bias that lasts for minutes, rounding to
the message's resolution, loss, delay and double reception come on top, each as the settings say.

Source: ITU-R M.1371-5, tables 1 and 2 (reporting intervals), annex 8 (messages).
"""

from dataclasses import dataclass
from datetime import datetime, timedelta
from math import floor, radians
from typing import Literal, TypeAlias

import numpy as np
from pyais import encode_dict

from app.domain.geodesy import EnuFrame
from app.simulation.motion import Motion
from app.simulation.settings import TrafficSettings
from app.simulation.ships import AIS_SHIP_TYPE
from app.simulation.traffic import KNOT_M_S, antenna_offset_m
from app.simulation.vessels import Transponder, Vessel

_STATIC_INTERVAL_S = 360.0
_TURNING_DEG = 5.0
_RESOLUTION = 600_000  # parts of a degree

_Message: TypeAlias = dict[str, str | int | float | bool | bytes]


@dataclass(frozen=True, slots=True)
class Transmission:
    """One message as heard: its sentences with tag blocks, and when it was made and heard."""

    mmsi: int
    kind: Literal["position", "static"]
    made_at: datetime
    heard_at: datetime
    lines: tuple[str, ...]


def reporting_interval_s(
    ais_class: Literal["A", "B"], speed_kn: float, *, moored: bool, turning: bool
) -> float:
    """Return the seconds between position reports of a class A or a class B (CS) unit."""
    if ais_class == "B":
        return 180.0 if speed_kn <= 2 else 30.0
    if moored and speed_kn <= 3:
        return 180.0
    if speed_kn <= 14:
        return 10 / 3 if turning else 10.0
    if speed_kn <= 23:
        return 2.0 if turning else 6.0
    return 2.0


def hear_vessel(
    rng: np.random.Generator,
    settings: TrafficSettings,
    frame: EnuFrame,
    start: datetime,
    vessel: Vessel,
    span_s: tuple[float, float],
) -> list[Transmission]:
    """Return all messages of a vessel made within `span_s` (seconds after `start`)."""
    unit = vessel.transponder
    if unit is None:
        return []
    receiver = _Receiver(rng, settings, start, unit.silence_s)
    time_s = span_s[0] + float(rng.uniform(0, 10))
    bias, last_s = rng.normal(0.0, 1.0, 2) * settings.bias_sigma_m, time_s
    while time_s < span_s[1]:
        fix_s = float(floor(time_s))  # positioning pulses come at whole seconds
        keep = float(np.exp(-(fix_s - last_s) / settings.bias_memory_s))
        fresh = rng.normal(0.0, 1.0, 2) * settings.bias_sigma_m
        bias, last_s = keep * bias + np.sqrt(max(0.0, 1 - keep**2)) * fresh, fix_s
        motion = vessel.passage.at(fix_s)
        error = bias + rng.normal(0.0, 1.0, 2) * settings.position_sigma_m
        second = (start + timedelta(seconds=fix_s)).second
        message = _position(rng, settings, frame, vessel, unit, motion, error, second)
        receiver.hear(unit.mmsi, "position", fix_s, time_s, message)
        turning = vessel.passage.turned_deg(time_s, 30.0) > _TURNING_DEG
        interval = reporting_interval_s(
            unit.ais_class, motion.speed_m_s / KNOT_M_S, moored=vessel.moored, turning=turning
        )
        jitter = float(rng.uniform(-0.1, 0.1)) if settings.slot_jitter else 0.0
        time_s += interval * (1 + jitter)
    time_s = span_s[0] + float(rng.uniform(0, _STATIC_INTERVAL_S))
    while time_s < span_s[1]:
        for message in _statics(vessel, unit):
            receiver.hear(unit.mmsi, "static", floor(time_s), time_s, message)
        time_s += _STATIC_INTERVAL_S
    return receiver.heard


class _Receiver:
    """Turns messages into lines, with everything that goes wrong on the way."""

    def __init__(
        self,
        rng: np.random.Generator,
        settings: TrafficSettings,
        start: datetime,
        silence_s: tuple[float, float] | None,
    ) -> None:
        self._rng, self._settings, self._start, self._silence_s = rng, settings, start, silence_s
        self._sequence = 0
        self.heard: list[Transmission] = []

    def hear(
        self,
        mmsi: int,
        kind: Literal["position", "static"],
        made_s: float,
        sent_s: float,
        message: _Message,
    ) -> None:
        rng, settings = self._rng, self._settings
        delay = settings.delay_median_s * float(np.exp(rng.normal(0.0, 0.5)))
        lost, late = rng.random() < settings.loss_share, rng.random() < settings.late_share
        if late:
            delay += float(rng.uniform(*settings.late_s))
        again = rng.random() < settings.duplicate_share
        second_delay = delay + float(rng.uniform(0.05, 1.5))
        channel = "AB"[int(rng.integers(2))]
        silence = self._silence_s
        if lost or (silence is not None and silence[0] <= sent_s < silence[1]):
            return
        self._sequence = (self._sequence + 1) % 10
        sentences = encode_dict(
            message,
            talker_id="AI",
            sentence_type="VDM",
            radio_channel=channel,
            seq_id=self._sequence,
        )
        for station, heard_s in (("quay", sent_s + delay), ("lock", sent_s + second_delay)):
            if station == "lock" and not again:
                continue
            heard_at = self._start + timedelta(seconds=heard_s)
            tag = _tag_block(heard_at, station, milliseconds=settings.millisecond_tags)
            made_at = self._start + timedelta(seconds=made_s)
            lines = tuple(tag + sentence for sentence in sentences)
            self.heard.append(Transmission(mmsi, kind, made_at, heard_at, lines))


def _position(
    rng: np.random.Generator,
    settings: TrafficSettings,
    frame: EnuFrame,
    vessel: Vessel,
    unit: Transponder,
    motion: Motion,
    error_m: np.ndarray[tuple[int], np.dtype[np.float64]],
    second: int,
) -> _Message:
    """Fill a message 1 or 18."""
    east, north = antenna_offset_m(unit, radians(motion.heading_deg))
    place = frame.geodetic(
        (motion.east_m + east + error_m[0], motion.north_m + north + error_m[1], 0.0)
    )
    speed_kn = max(0.0, motion.speed_m_s / KNOT_M_S + float(rng.normal()) * settings.speed_sigma_kn)
    course = (motion.course_deg + float(rng.normal()) * settings.course_sigma_deg) % 360
    heading = round(motion.heading_deg + unit.compass_error_deg) % 360
    message: _Message = {
        "mmsi": unit.mmsi,
        "speed": round(speed_kn, 1) + 0.02,  # pyais cuts off: a little more than the tenth
        "accuracy": settings.bias_sigma_m < 5,
        "lon": _on_grid(place.lon_deg),
        "lat": _on_grid(place.lat_deg),
        "course": round(course % 359.95, 1) + 0.02,
        "heading": heading if unit.heading else 511,
        "second": second,
    }
    if unit.ais_class == "B":
        return message | {"type": 18, "cs": True}
    turn = motion.turn_deg_min if unit.heading else -128.0
    status = 5 if vessel.moored else 0
    return message | {"type": 1, "status": status, "turn": turn, "maneuver": 0}


def _on_grid(angle_deg: float) -> float:
    """Round to the message's resolution; a quarter step outwards keeps pyais from cutting more."""
    steps = round(angle_deg * _RESOLUTION)
    return (steps + (0.25 if steps >= 0 else -0.25)) / _RESOLUTION


def _statics(vessel: Vessel, unit: Transponder) -> list[_Message]:
    """Fill a message 5, or both parts of a message 24."""
    sizes: _Message = {
        "to_bow": unit.to_bow_m,
        "to_stern": unit.to_stern_m,
        "to_port": unit.to_port_m,
        "to_starboard": unit.to_starboard_m,
    }
    kind: _Message = {"mmsi": unit.mmsi, "ship_type": AIS_SHIP_TYPE[vessel.ship.ship_type]}
    if unit.ais_class == "B":
        name: _Message = {"type": 24, "mmsi": unit.mmsi, "partno": 0, "shipname": vessel.name}
        part_b: _Message = {"type": 24, "partno": 1, "callsign": vessel.callsign}
        return [name, part_b | kind | sizes]
    voyage: _Message = {"imo": vessel.imo, "callsign": vessel.callsign, "shipname": vessel.name}
    rest: _Message = {"type": 5, "epfd": 1, "draught": 3.2, "destination": "QUAYMARK"}
    return [rest | voyage | kind | sizes]


def _tag_block(heard_at: datetime, station: str, *, milliseconds: bool) -> str:
    """Return an NMEA 4.0 tag block with source and time, and its checksum."""
    seconds = heard_at.timestamp()
    stamp = str(floor(seconds * 1000) if milliseconds else floor(seconds))
    content = f"s:{station},c:{stamp}"
    checksum = 0
    for character in content.encode():
        checksum ^= character
    return f"\\{content}*{checksum:02X}\\"
