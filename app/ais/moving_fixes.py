"""Positions of many vessels as columns: what a map draws, without an object for each of them.

Half an hour of a thousand vessels is 180,000 positions. As rows of Python objects they cost more
than reading them from the database; as columns they are sorted, compared and put into whole numbers
all at once. A vessel's own fixes are a slice.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import chain, pairwise
from typing import Self

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray

UNKNOWN = -1.0


@dataclass(frozen=True, eq=False)
class MovingFixes:
    """Fixes (n,) in the order of vessels, of each the oldest first.

    Times are seconds since any moment, places degrees, speeds knots; NaN for what is unknown.
    `source` is an index of `SOURCES`, `ais_class` of `AIS_CLASSES`.
    """

    mmsi: IntArray
    time_s: FloatArray
    lat_deg: FloatArray
    lon_deg: FloatArray
    sog_kn: FloatArray
    cog_deg: FloatArray
    heading_deg: FloatArray
    source: IntArray
    ais_class: IntArray

    @classmethod
    def of(cls, rows: Iterable[Iterable[float]], start_s: float) -> Self:
        """Put rows of `COLUMNS` into columns; `start_s` is the moment that becomes second 0.

        A vessel's rows come the oldest first. What is unknown is `UNKNOWN` in them, as databases
        have no NaN.
        """
        numbers = np.fromiter(chain.from_iterable(rows), dtype=np.float64)
        columns = numbers.reshape(-1, len(COLUMNS)).T
        order = np.argsort(columns[0], kind="stable")
        mmsi, time_s, lat_deg, lon_deg, *motion, source, ais_class = columns[:, order]
        sog_kn, cog_deg, heading_deg = (
            np.where(column == UNKNOWN, np.nan, column) for column in motion
        )
        return cls(
            mmsi.astype(np.int64),
            np.round(time_s - start_s, 2),
            lat_deg,
            lon_deg,
            sog_kn,
            cog_deg,
            heading_deg,
            source.astype(np.int64),
            ais_class.astype(np.int64),
        )

    def __len__(self) -> int:
        """Return how many fixes there are."""
        return len(self.mmsi)

    def taken(self, which: IntArray | BoolArray) -> Self:
        """Return some of the fixes, in the order told."""
        return type(self)(*(getattr(self, name)[which] for name in COLUMNS))

    def once(self) -> Self:
        """Return the fixes without repeats: one may stand in a site's file and in a shared one."""
        is_new = np.full(len(self), True)
        is_new[1:] = (np.diff(self.mmsi) != 0) | (np.diff(self.time_s) > 0)
        return self.taken(is_new)

    @property
    def starts(self) -> IntArray:
        """Where each vessel's fixes begin."""
        changes: IntArray = np.flatnonzero(np.diff(self.mmsi)) + 1
        return np.concatenate([[0], changes]) if len(self) else changes

    def slices(self) -> Iterator[slice]:
        """Yield each vessel's fixes."""
        return (slice(*bounds) for bounds in pairwise([*self.starts.tolist(), len(self)]))


COLUMNS = tuple(each.name for each in fields(MovingFixes))
