"""Images of one viewport that are seconds apart: a series, through which vessels can be followed.

Minutes apart, a vessel may be anywhere: such images are matched each by itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from app.domain.image_tracks import image_tracks
from app.domain.seen_boxes import SeenBoxes


@dataclass(frozen=True, slots=True)
class SeriesTrack:
    """A track through a series: the rows of its boxes, and the images they are in."""

    rows: Sequence[int]
    images: Sequence[int]


def split_series(times_s: Sequence[float], gap_s: float) -> list[range]:
    """Return the series (of two images or more, by index) in images whose times rise.

    Within a series no two neighbours are more than `gap_s` apart.
    """
    cuts = [i + 1 for i, (one, two) in enumerate(pairwise(times_s)) if two - one > gap_s]
    bounds = pairwise([0, *cuts, len(times_s)])
    return [range(first, last) for first, last in bounds if last - first > 1]


def series_tracks(
    boxes: SeenBoxes, series: Sequence[int], times_s: Sequence[float]
) -> list[SeriesTrack]:
    """Follow the detections (not units) of a series; `times_s` are those of all images."""
    rows = [np.flatnonzero((boxes.scene == image) & ~boxes.is_unit).tolist() for image in series]
    at_s = [times_s[image] for image in series]
    found = image_tracks(at_s, [[(row, boxes.all[row]) for row in here] for here in rows])
    return [
        SeriesTrack([row for _, row in samples], [image for image, _ in samples])
        for samples in found
    ]
