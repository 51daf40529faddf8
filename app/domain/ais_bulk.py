"""Position payloads by the thousand: the fields of many messages at once, as columns.

`ais_payload` reads one message; here numpy reads the same bits of thousands of messages in one
step. What a raw number means is not said a second time: tables filled by the functions of `ais`
translate speeds, courses, headings and rates of turn. Only what is usable becomes a row. The rest
(no position, not a vessel) is for `ais_payload`, which knows its bucket.

Source: ITU-R M.1371-5, Annex 8 (tables 48, 70); bit offsets count from 0.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.domain import ais
from app.domain.arrays import FloatArray
from app.domain.nmea_times import epoch_us
from app.domain.payload_bits import (
    BoolArray,
    IntArray,
    Letters,
    PayloadBits,
    are_vessels,
    are_within,
)

POSITION_LETTERS = 28  # 168 bits: types 1, 2, 3 and 18 alike
POSITION_TYPES = b"123B"  # as their armoured first letter has them

AIS_CLASSES = (None, "A", "B")
ACCURACIES = (None, False, True)
SOURCES = tuple(ais.FixTimeSource)

_CLASS_B = 18
_NO_TURN = 128
_FLOATS = {"lat_deg", "lon_deg", "sog_kn", "cog_deg", "heading_deg", "rot_deg_min"}


@dataclass(frozen=True, slots=True)
class PositionTable:
    """Position reports: the fields of `PositionReport` as columns.

    `fix_us` and `received_us` are microseconds since 1970 in UTC. NaN stands for "not available".
    What is no number is told by its place among `AIS_CLASSES`, `ACCURACIES` or `SOURCES`.
    """

    mmsi: IntArray
    fix_us: IntArray
    received_us: IntArray
    lat_deg: FloatArray
    lon_deg: FloatArray
    sog_kn: FloatArray
    cog_deg: FloatArray
    heading_deg: FloatArray
    rot_deg_min: FloatArray
    message_type: IntArray
    ais_class: IntArray
    high_accuracy: IntArray
    fix_time_source: IntArray

    def __len__(self) -> int:
        return int(self.mmsi.size)

    @classmethod
    def of(cls, reports: Sequence[ais.PositionReport]) -> "PositionTable":
        """Return reports as a table."""
        rows = [
            (
                report.mmsi,
                epoch_us(report.fix_time),
                epoch_us(report.received_at),
                report.lat_deg,
                report.lon_deg,
                report.sog_kn,
                report.cog_deg,
                report.heading_deg,
                report.rot_deg_min,
                report.message_type,
                AIS_CLASSES.index(report.ais_class),
                ACCURACIES.index(report.high_accuracy),
                SOURCES.index(report.fix_time_source),
            )
            for report in reports
        ]
        fields: dict[str, Any] = {
            name: np.array(column, dtype=np.float64 if name in _FLOATS else np.int64)
            for name, column in zip(cls.__dataclass_fields__, zip(*rows, strict=True), strict=True)
        }
        return cls(**fields)

    @classmethod
    def joined(cls, tables: Sequence["PositionTable"]) -> "PositionTable":
        """Return the rows of several tables as one."""
        names = cls.__dataclass_fields__
        return cls(**{name: np.concatenate([getattr(t, name) for t in tables]) for name in names})

    def chosen(self, rows: IntArray) -> "PositionTable":
        """Return some rows, in that order."""
        names = self.__dataclass_fields__
        return PositionTable(**{name: getattr(self, name)[rows] for name in names})


class PositionBits:
    """Many position payloads; `usable` tells which are a vessel's and have a place."""

    def __init__(self, letters: Letters) -> None:
        """Take (payloads, `POSITION_LETTERS`) letters; they begin with one of `POSITION_TYPES`."""
        self._bits = PayloadBits(letters)
        self._type, self._mmsi = self._bits.message_type, self._bits.mmsi
        self._is_b = self._type == _CLASS_B
        self._lon = _signed(self._motion(11, 28), 28)
        self._lat = _signed(self._motion(39, 27), 27)
        has_place = are_within(self._lat, ais.LATITUDES) & are_within(self._lon, ais.LONGITUDES)
        self.usable: BoolArray = has_place & are_vessels(self._mmsi)

    def table(self, chosen: IntArray, received_us: IntArray) -> PositionTable:
        """Return the chosen payloads' reports; `received_us` belongs to the chosen."""
        fix_us, source = fix_times(received_us, self._motion(87, 6)[chosen])
        is_b = self._is_b[chosen]
        return PositionTable(
            mmsi=self._mmsi[chosen],
            fix_us=fix_us,
            received_us=received_us,
            lat_deg=self._lat[chosen] / ais.UNITS_PER_DEG,
            lon_deg=self._lon[chosen] / ais.UNITS_PER_DEG,
            sog_kn=_SPEEDS[self._motion(0, 10)[chosen]],
            cog_deg=_COURSES[self._motion(66, 12)[chosen]],
            heading_deg=_HEADINGS[self._motion(78, 9)[chosen]],
            rot_deg_min=_TURNS[np.where(is_b, _NO_TURN, self._bits.unsigned(42, 8)[chosen])],
            message_type=self._type[chosen],
            ais_class=1 + is_b,
            high_accuracy=1 + self._motion(10, 1)[chosen],
            fix_time_source=source,
        )

    def _motion(self, start: int, width: int) -> IntArray:
        """Read of the bits from speed to UTC second, which class B has four bits earlier."""
        of_a, of_b = (self._bits.unsigned(at + start, width) for at in (50, 46))
        return np.where(self._is_b, of_b, of_a)


def fix_times(received_us: IntArray, utc_second: IntArray) -> tuple[IntArray, IntArray]:
    """Return the moments of fixes, us since 1970, and their sources: `ais.fix_time` by column."""
    lag = (received_us % ais.MINUTE_US - utc_second * 1_000_000) % ais.MINUTE_US
    lag = np.where(lag >= ais.MINUTE_US + ais.EARLIEST_LAG_US, lag - ais.MINUTE_US, lag)
    source = np.where(lag > ais.PROMPT_LAG_US, _DOUBTFUL, _PROMPT)
    source = np.where(utc_second > ais.LAST_UTC_SECOND, _RECEIVED, source)
    return received_us - np.where(source == _PROMPT, lag, 0), source


def _signed(value: IntArray, width: int) -> IntArray:
    sign = 1 << (width - 1)
    signed: IntArray = (value ^ sign) - sign
    return signed


def _meanings(meaning: Callable[[int], float | None], raws: Sequence[int]) -> FloatArray:
    """Return what raw numbers mean, NaN for nothing."""
    return np.array([meaning(raw) for raw in raws], dtype=np.float64)


_SPEEDS = _meanings(ais.speed_kn, range(1 << 10))
_COURSES = _meanings(ais.course_deg, range(1 << 12))
_HEADINGS = _meanings(ais.heading_deg, range(1 << 9))
_TURNS = _meanings(ais.rate_of_turn_deg_min, [*range(128), *range(-128, 0)])
_PROMPT, _RECEIVED, _DOUBTFUL = map(
    SOURCES.index,
    (ais.FixTimeSource.PROMPT, ais.FixTimeSource.RECEIVED, ais.FixTimeSource.DOUBTFUL),
)
