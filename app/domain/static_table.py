"""Static reports as columns: what `PositionTable` is for positions.

Names and call signs are texts of any length and most fields are empty, so those columns hold what a
report holds, None included; only the sizes are numbers throughout.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from app.domain.ais import StaticReport
from app.domain.arrays import FloatArray
from app.domain.nmea_times import epoch_us
from app.domain.payload_bits import IntArray

ObjectArray = npt.NDArray[np.object_]
_NUMBERS = {"to_bow_m", "to_stern_m", "to_port_m", "to_starboard_m"}


@dataclass(frozen=True, slots=True)
class StaticTable:
    """Static reports: the fields of `StaticReport` as columns.

    `received_us` is microseconds since 1970 in UTC. Of what was not said sizes are NaN, all else is
    None.
    """

    mmsi: IntArray
    received_us: IntArray
    name: ObjectArray
    callsign: ObjectArray
    imo: ObjectArray
    ship_type: ObjectArray
    to_bow_m: FloatArray
    to_stern_m: FloatArray
    to_port_m: FloatArray
    to_starboard_m: FloatArray
    mothership_mmsi: ObjectArray

    def __len__(self) -> int:
        return int(self.mmsi.size)

    @classmethod
    def saying(cls, mmsi: IntArray, received_us: IntArray, **said: Any) -> "StaticTable":  # noqa: ANN401  columns of several types
        """Return a table of some fields; of the others nothing was said."""
        columns: dict[str, Any] = {}
        for name in list(cls.__dataclass_fields__)[2:]:
            dtype = np.float64 if name in _NUMBERS else np.object_
            column = said.get(name)
            if column is None:
                columns[name] = np.full(mmsi.size, None, dtype=dtype)  # NaN as a number
            else:
                columns[name] = np.array(column, dtype=dtype)
        return cls(mmsi, received_us, **columns)

    @classmethod
    def of(cls, reports: Sequence[StaticReport]) -> "StaticTable":
        """Return reports as a table."""
        return cls.saying(
            np.array([report.mmsi for report in reports], dtype=np.int64),
            np.array([epoch_us(report.received_at) for report in reports], dtype=np.int64),
            **{
                name: [getattr(report, name) for report in reports]
                for name in list(cls.__dataclass_fields__)[2:]
            },
        )

    @classmethod
    def joined(cls, tables: Sequence["StaticTable"]) -> "StaticTable":
        """Return the rows of several tables as one."""
        names = cls.__dataclass_fields__
        return cls(**{name: np.concatenate([getattr(t, name) for t in tables]) for name in names})

    def chosen(self, rows: IntArray) -> "StaticTable":
        """Return some rows, in that order."""
        names = self.__dataclass_fields__
        return StaticTable(**{name: getattr(self, name)[rows] for name in names})
