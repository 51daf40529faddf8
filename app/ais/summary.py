"""What a recording says of each vessel, gathered while it is decoded.

Reports are many and vessels few. So reports are put by as columns, and now and then all that were
put by are folded into one row for each vessel: when it was heard first and last, and of each thing
that vessels say of themselves the latest word.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import PositionTable
from app.domain.nmea_bulk import Decoded
from app.domain.nmea_times import epoch_us, moment_of
from app.domain.payload_bits import BoolArray, IntArray
from app.domain.static_table import StaticTable

_MOST_PUT_BY = 50_000  # reports


@dataclass(frozen=True, slots=True)
class VesselSummary:
    """A vessel as last heard of in one recording; None where it did not say."""

    first_seen_at: datetime
    last_seen_at: datetime
    name: str | None = None
    callsign: str | None = None
    imo: int | None = None
    ship_type: int | None = None
    length_m: float | None = None
    width_m: float | None = None


class RecordingSummary:
    """The vessels of a recording by MMSI, and when its first and last report were."""

    def __init__(self) -> None:
        self._heard = _Heard()
        self._said = {name: _LatestWord() for name in list(VesselSummary.__slots__)[2:]}
        self._put_by = 0
        self._times: list[tuple[IntArray, IntArray]] = []
        self._statics: list[StaticTable] = []
        self._singles: list[PositionReport | StaticReport] = []

    def add(self, report: Decoded) -> None:
        """Count a report, or many."""
        if isinstance(report, PositionTable):
            self._times.append((report.mmsi, report.fix_us))
            self._put_by += len(report)
        elif isinstance(report, StaticTable):
            self._statics.append(report)
            self._put_by += len(report)
        else:
            self._singles.append(report)
            self._put_by += 1
        if self._put_by >= _MOST_PUT_BY:
            self._fold()

    @property
    def vessels(self) -> dict[int, VesselSummary]:
        """The vessels so far."""
        self._fold()
        said = {name: word.by_mmsi() for name, word in self._said.items()}
        return {
            mmsi: VesselSummary(
                moment_of(first_us),
                moment_of(last_us),
                **{name: words.get(mmsi) for name, words in said.items()},
            )
            for mmsi, first_us, last_us in self._heard.vessels()
        }

    @property
    def vessel_count(self) -> int:
        """How many vessels there are so far."""
        self._fold()
        return int(self._heard.mmsi.size)

    @property
    def first(self) -> datetime | None:
        """The moment of the first report."""
        self._fold()
        first_us = self._heard.first_us
        return moment_of(int(first_us.min())) if first_us.size else None

    @property
    def last(self) -> datetime | None:
        """The moment of the last report."""
        self._fold()
        last_us = self._heard.last_us
        return moment_of(int(last_us.max())) if last_us.size else None

    def _fold(self) -> None:
        if not self._put_by:
            return
        self._put_by_singles()
        if self._statics:
            self._hear(StaticTable.joined(self._statics))
        self._heard.add(*map(np.concatenate, zip(*self._times, strict=True)))
        self._put_by = 0
        self._times, self._statics = [], []

    def _put_by_singles(self) -> None:
        statics = [report for report in self._singles if isinstance(report, StaticReport)]
        if statics:
            self._statics.append(StaticTable.of(statics))
        fixes = [
            (report.mmsi, epoch_us(report.fix_time))
            for report in self._singles
            if not isinstance(report, StaticReport)
        ]
        if fixes:
            mmsi, fix_us = np.array(fixes, dtype=np.int64).T
            self._times.append((mmsi, fix_us))
        self._singles = []

    def _hear(self, table: StaticTable) -> None:
        self._times.append((table.mmsi, table.received_us))
        for name, values in (
            ("name", table.name),
            ("callsign", table.callsign),
            ("imo", table.imo),
            ("ship_type", table.ship_type),
            ("length_m", table.to_bow_m + table.to_stern_m),
            ("width_m", table.to_port_m + table.to_starboard_m),
        ):
            at = np.flatnonzero(_are_said(values))
            self._said[name].add(table.mmsi[at], table.received_us[at], values[at])


class _Heard:
    """When each vessel was first and last heard, us since 1970; a row for each vessel."""

    def __init__(self) -> None:
        self.mmsi: IntArray = np.empty(0, dtype=np.int64)
        self.first_us = self.last_us = self.mmsi

    def add(self, mmsi: IntArray, heard_us: IntArray) -> None:
        """Take over when vessels were heard."""
        mmsi = np.concatenate([self.mmsi, mmsi])
        order = np.argsort(mmsi, kind="stable")
        self.mmsi, starts = np.unique(mmsi[order], return_index=True)
        first_us = np.concatenate([self.first_us, heard_us])[order]
        last_us = np.concatenate([self.last_us, heard_us])[order]
        self.first_us = np.minimum.reduceat(first_us, starts)
        self.last_us = np.maximum.reduceat(last_us, starts)

    def vessels(self) -> Iterator[tuple[int, int, int]]:
        """Yield MMSI, first and last moment of each vessel."""
        columns = self.mmsi.tolist(), self.first_us.tolist(), self.last_us.tolist()
        return zip(*columns, strict=True)


class _LatestWord:
    """What each vessel said last of one thing, and when; a row for each vessel that said it."""

    def __init__(self) -> None:
        self._mmsi: IntArray = np.empty(0, dtype=np.int64)
        self._said_us = self._mmsi
        self._values: npt.NDArray[Any] = np.empty(0, dtype=np.object_)

    def add(self, mmsi: IntArray, said_us: IntArray, values: npt.NDArray[Any]) -> None:
        """Take over what vessels said; of two words of one moment the later one here counts."""
        mmsi = np.concatenate([self._mmsi, mmsi])
        said_us = np.concatenate([self._said_us, said_us])
        order = np.lexsort((said_us, mmsi))
        is_last: BoolArray = np.full(order.size, True)
        is_last[:-1] = mmsi[order[1:]] != mmsi[order[:-1]]
        last = order[is_last]
        self._mmsi, self._said_us = mmsi[last], said_us[last]
        self._values = np.concatenate([self._values, values.astype(np.object_)])[last]

    def by_mmsi(self) -> dict[int, Any]:
        """Return the words by vessel."""
        return dict(zip(self._mmsi.tolist(), self._values.tolist(), strict=True))


def _are_said(values: npt.NDArray[Any]) -> BoolArray:
    """Return which values are neither NaN nor None."""
    if values.dtype == np.float64:
        is_number: BoolArray = ~np.isnan(values)
        return is_number
    return np.array([value is not None for value in values.tolist()], dtype=np.bool_)
