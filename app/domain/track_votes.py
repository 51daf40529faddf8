"""What all boxes of a track say together of the vessels that it may show.

Each box is a voice: its log odds for each vessel by its own image. AIS is off by the same metres in
images seconds apart, so the voices are not independent and are not added up: the median is what the
track says. A box that another ship half hides, or that the tracker took from a stranger, is
outvoted. One assignment gives the tracks of a series to vessels; two tracks may be pieces of one
vessel's only where no image shows both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.image_series import SeriesTrack

_FEWEST_BOXES = 3  # of a track that votes
# A vessel that is not near a box of the track at all has this much against it, log odds.
_NOWHERE = -10.0
# A box this improbable by its own image is not its track's: the tracker changed ships.
_STRANGE = -8.0


@dataclass(frozen=True, eq=False)
class Voices:
    """The p pairs of boxes and vessels of a while: rows of boxes, numbers of vessels, log odds."""

    row: IntArray
    vessel: IntArray
    worth: FloatArray


def vote(voices: Voices, tracks: Sequence[SeriesTrack]) -> tuple[FloatArray, BoolArray]:
    """Return the log odds (p,) with those of whole tracks, and which pairs may be made (p,).

    Pairs of a track may be made with the vessel it was given to; short tracks, units and boxes
    that their track's vessel cannot explain are left to their own images.
    """
    worth, allowed = voices.worth.copy(), np.ones(len(voices.worth), dtype=bool)
    voting = [track for track in tracks if len(track.rows) >= _FEWEST_BOXES]
    pairs_of = [np.flatnonzero(np.isin(voices.row, track.rows)) for track in voting]
    table = np.full((len(voting), int(voices.vessel.max(initial=-1)) + 1), -np.inf)
    for number, (track, pairs) in enumerate(zip(voting, pairs_of, strict=True)):
        table[number] = _verdict(voices, track, pairs, table.shape[1])
    given = assign_tracks(table, _seen_together(voting))
    for number, pairs in enumerate(pairs_of):
        mine = voices.vessel[pairs] == given[number]
        worth[pairs] = table[number, voices.vessel[pairs]]
        allowed[pairs] = mine & (voices.worth[pairs] > _STRANGE)
    return worth, allowed


def _verdict(voices: Voices, track: SeriesTrack, pairs: IntArray, vessel_count: int) -> FloatArray:
    """Return the median log odds of a track's boxes for each vessel."""
    said = np.full((len(track.rows), vessel_count), _NOWHERE)
    order = np.argsort(track.rows)
    box = order[np.searchsorted(track.rows, voices.row[pairs], sorter=order)]
    said[box, voices.vessel[pairs]] = voices.worth[pairs]
    return np.asarray(np.median(said, axis=0))


def _seen_together(tracks: Sequence[SeriesTrack]) -> BoolArray:
    """Return which tracks (n, n) have boxes in the same image."""
    images = [set(track.images) for track in tracks]
    return np.array([[bool(one & other) for other in images] for one in images]).reshape(
        len(images), len(images)
    )


def assign_tracks(worth: FloatArray, together: BoolArray) -> IntArray:
    """Return for each track (rows of `worth`, log odds) its vessel, or -1 for none.

    Tracks seen `together` (n, n) get different vessels.
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - keeps the web process small

    vessel_of = np.full(len(worth), -1)
    left = worth.copy()
    while True:
        rows, columns = linear_sum_assignment(np.minimum(-left, 0.0))
        good = left[rows, columns] > 0
        if not good.any():
            return vessel_of
        vessel_of[rows[good]] = columns[good]
        left[rows[good]] = -np.inf
        for row, column in zip(rows[good], columns[good], strict=True):
            left[together[row], column] = -np.inf
