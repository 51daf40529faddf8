"""What a recording says of each vessel, gathered while it is decoded."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import PositionTable
from app.domain.nmea_times import moment_of
from app.domain.payload_bits import IntArray


@dataclass(slots=True)
class VesselSummary:
    """A vessel as last heard of in one recording; None where it did not say."""

    first_seen_at: datetime
    last_seen_at: datetime
    said_at: datetime | None = None
    name: str | None = None
    callsign: str | None = None
    imo: int | None = None
    ship_type: int | None = None
    length_m: float | None = None
    width_m: float | None = None

    def add(self, static: StaticReport) -> None:
        """Take over what a static report says; an older one only fills gaps."""
        is_newer = self.said_at is None or static.received_at >= self.said_at
        for name, value in (
            ("name", static.name),
            ("callsign", static.callsign),
            ("imo", static.imo),
            ("ship_type", static.ship_type),
            ("length_m", _sum(static.to_bow_m, static.to_stern_m)),
            ("width_m", _sum(static.to_port_m, static.to_starboard_m)),
        ):
            if value is not None and (is_newer or getattr(self, name) is None):
                setattr(self, name, value)
        if is_newer:
            self.said_at = static.received_at


class RecordingSummary:
    """The vessels of a recording by MMSI, and when its first and last report were."""

    def __init__(self) -> None:
        self._vessels: dict[int, VesselSummary] = {}
        self._heard = _Heard()

    @property
    def vessels(self) -> dict[int, VesselSummary]:
        """The vessels so far."""
        for mmsi, first_us, last_us in self._heard.vessels():
            self._hear(mmsi, moment_of(first_us), moment_of(last_us))
        return self._vessels

    def add(self, report: PositionTable | PositionReport | StaticReport) -> None:
        """Count a report, or many."""
        if isinstance(report, PositionTable):
            self._heard.add(report)
        elif isinstance(report, StaticReport):
            self._hear(report.mmsi, report.received_at, report.received_at).add(report)
        else:
            self._hear(report.mmsi, report.fix_time, report.fix_time)

    def _hear(self, mmsi: int, first: datetime, last: datetime) -> VesselSummary:
        vessel = self._vessels.get(mmsi)
        if vessel is None:
            vessel = self._vessels[mmsi] = VesselSummary(first, last)
        vessel.first_seen_at = min(vessel.first_seen_at, first)
        vessel.last_seen_at = max(vessel.last_seen_at, last)
        return vessel

    @property
    def first(self) -> datetime | None:
        """The moment of the first report."""
        return min((vessel.first_seen_at for vessel in self.vessels.values()), default=None)

    @property
    def last(self) -> datetime | None:
        """The moment of the last report."""
        return max((vessel.last_seen_at for vessel in self.vessels.values()), default=None)


class _Heard:
    """When each vessel of many tables was first and last heard, us since 1970."""

    def __init__(self) -> None:
        self._mmsi: IntArray = np.empty(0, dtype=np.int64)
        self._first_us = self._last_us = self._mmsi

    def add(self, table: PositionTable) -> None:
        """Take over what a table says."""
        mmsi = np.concatenate([self._mmsi, table.mmsi])
        order = np.argsort(mmsi, kind="stable")
        self._mmsi, starts = np.unique(mmsi[order], return_index=True)
        first_us = np.concatenate([self._first_us, table.fix_us])[order]
        last_us = np.concatenate([self._last_us, table.fix_us])[order]
        self._first_us = np.minimum.reduceat(first_us, starts)
        self._last_us = np.maximum.reduceat(last_us, starts)

    def vessels(self) -> Iterator[tuple[int, int, int]]:
        """Yield MMSI, first and last moment of each vessel."""
        columns = self._mmsi.tolist(), self._first_us.tolist(), self._last_us.tolist()
        return zip(*columns, strict=True)


def _sum(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else one + other
