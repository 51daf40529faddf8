"""Poses column by column, as the writers of long files get them: a loop over rows costs twice.

A column holds a value of each pose, in one order. What formats say of a pose in other words stays
with the formats.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import hypot, isfinite

import numpy as np
import numpy.typing as npt

from app.exports.writers.records import ImageRecord, Matrix, Pixels, ReviewRecord


@dataclass(frozen=True, slots=True)
class PoseTable:
    """Columns of poses (see `PoseRecord`); the first pose has a number, counted from 0.

    Rotations are (n, 3, 3).
    """

    first: int
    ids: Sequence[int]
    run_ids: Sequence[int]
    registration_ids: Sequence[int]
    viewport_ids: Sequence[int]
    images: Sequence[ImageRecord]
    vessels: Sequence[str]
    boxes_px: Sequence[tuple[float, float, float, float]]
    scores: Sequence[float]
    costs: Sequence[float]
    centroids_in_cam_m: Sequence[Sequence[float]]
    rotations_cam_from_vessel: npt.NDArray[np.float64]
    rotvecs_cam_from_vessel: Sequence[Sequence[float]]
    lats_deg: Sequence[float]
    lons_deg: Sequence[float]
    center_heights_m: Sequence[float]
    headings_deg: Sequence[float]
    heading_sources: Sequence[str]
    report_ages_s: Sequence[float]
    lengths_m: Sequence[float]
    widths_m: Sequence[float]
    heights_m: Sequence[float]
    corners_in_image_px: Sequence[Pixels]
    corrections_in_enu_m: Sequence[Sequence[float]]
    position_covariances_in_enu_m2: Sequence[Matrix | None]
    heading_sigmas_deg: Sequence[float | None]
    height_sigmas_m: Sequence[float | None]
    flags: Sequence[Sequence[str]]
    reviews: Sequence[ReviewRecord | None]
    sources: Sequence[str]
    parts: Sequence[str | None]

    def refuse_what_is_no_number(self) -> None:
        """Raise ValueError for NaN or infinity: only some readers would open the file."""
        numbers: Sequence[Sequence[float]] = (
            *(self.scores, self.costs, self.report_ages_s, self.lats_deg, self.lons_deg),
            *(self.center_heights_m, self.headings_deg),
            *(self.lengths_m, self.widths_m, self.heights_m),
        )
        nested = (self.boxes_px, self.centroids_in_cam_m)
        # The root of a sum of squares: no two numbers hide one another in it.
        if all(isfinite(hypot(*column)) for column in numbers) and all(
            isfinite(hypot(*chain.from_iterable(column))) for column in nested
        ):
            return
        for row in zip(self.ids, *numbers, *nested, strict=True):
            if not all(isfinite(value) for value in _flat(row)):
                raise ValueError(f"pose {row[0]} holds a number that is not finite")


def _flat(row: Iterable[object]) -> Iterable[float]:
    for value in row:
        if isinstance(value, int | float):
            yield value
        elif isinstance(value, Sequence):
            yield from value
