"""Cells: the globe's surface as a grid of 0.05 degrees, so that a plain index finds what is near.

"Near a camera at a moment" has two sides. An index on time alone finds the moment everywhere, one
on latitude a band around the globe; both grow with everything that was ever heard elsewhere. With
the numbers of its hour and of its cell in front of its time, the positions of a few cells and of a
few minutes lie side by side in an index, on every database; and those of a time, wherever they are,
lie together too. Cells are numbered row by row from the south-west, hours from 1970.
"""

import math
from datetime import datetime

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

CELLS_PER_DEG = 20
CELLS_IN_A_ROW = 360 * CELLS_PER_DEG + 1  # 180 degrees east has a cell of its own
HOUR_US = 3_600_000_000


def hour_of(moment: datetime) -> int:
    """Return the hour of a moment."""
    return int(moment.timestamp() // 3600)


def cell_of(lat_deg: float, lon_deg: float) -> int:
    """Return the cell of a place: latitude in -90..90, longitude in -180..180."""
    return _row(lat_deg) * CELLS_IN_A_ROW + _column(lon_deg)


def cells_of(lat_deg: FloatArray, lon_deg: FloatArray) -> npt.NDArray[np.int64]:
    """Return the cells of many places: `cell_of` by column."""
    rows = np.floor((lat_deg + 90) * CELLS_PER_DEG).astype(np.int64)
    return rows * CELLS_IN_A_ROW + np.floor((lon_deg + 180) * CELLS_PER_DEG).astype(np.int64)


def cells_of_box(
    west_deg: float, south_deg: float, east_deg: float, north_deg: float, most: int
) -> list[int] | None:
    """Return the cells that a box touches, or None if there are more than `most`.

    A box whose west edge lies east of its east edge crosses the antimeridian.
    """
    columns = list(range(_column(west_deg), _column(east_deg) + 1))
    if west_deg > east_deg:
        columns = [*range(_column(east_deg) + 1), *range(_column(west_deg), CELLS_IN_A_ROW)]
    rows = range(_row(south_deg), _row(north_deg) + 1)
    if len(rows) * len(columns) > most:
        return None
    return [row * CELLS_IN_A_ROW + column for row in rows for column in columns]


def _row(lat_deg: float) -> int:
    return math.floor((lat_deg + 90) * CELLS_PER_DEG)


def _column(lon_deg: float) -> int:
    return math.floor((lon_deg + 180) * CELLS_PER_DEG)
