"""The most probable explanation of an image: which pairs are made, all of them together.

A box shows a vessel with AIS or none, a vessel is detected or not: a pair is made where that is
more probable than both being left alone, and no detection is in two pairs.
"""

from itertools import pairwise

import numpy as np

from app.domain.arrays import FloatArray, IntArray
from app.domain.pair_evidence import PairEvidence

_SURE_ODDS = 6.0


def explained(pairing: PairEvidence, worth: FloatArray) -> IntArray:
    """Return the pairs, by index, of the most probable explanation of each image.

    `worth` (p,) are the log odds of each pair against both of its ends being left alone.
    """
    taken = []
    for first, last in pairwise(pairing.bounds):
        # A pair is worth making where it beats both of its ends being left alone.
        good = first + np.flatnonzero(worth[first:last] > 0)
        if len(good):
            taken.append(_of_image(pairing, worth, good))
    return np.concatenate(taken) if taken else np.zeros(0, dtype=np.intp)


def _of_image(pairing: PairEvidence, worth: FloatArray, good: IntArray) -> IntArray:
    """Return which of the good pairs of one image explain it best, no box in two of them.

    Of two boxes that share a detection, or of which one may be a part of the other, the one with
    the less probable pair is left out, and the rest is explained anew.
    """
    boxes, scene = pairing.boxes, int(pairing.scene[good[0]])
    while len(good):
        found = _cheapest(pairing, worth, good)
        row = pairing.row[found]
        excluding = boxes.excluding(scene, row)
        if excluding is None:
            return found
        shared, part = excluding
        # What may be a part shows another vessel only where that is sure.
        one, other = np.nonzero(shared | part & (worth[found] < _SURE_ODDS)[:, None])
        if not len(one):
            return found
        both = np.concatenate([one, other])
        worst = row[both[np.argmin(worth[found][both])]]
        good = good[pairing.row[good] != worst]
    return good


def _cheapest(pairing: PairEvidence, worth: FloatArray, good: IntArray) -> IntArray:
    """Return the pairs of the assignment with the largest worth together."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - keeps the web process small

    # The boxes of an image stand together.
    row, column = pairing.row[good], pairing.candidate[good]
    row -= row.min()
    matrix = np.zeros((row.max() + 1, column.max() + 1))
    matrix[row, column] = -worth[good]
    number = np.full(matrix.shape, -1)
    number[row, column] = good
    found = number[linear_sum_assignment(matrix)]
    return np.asarray(found[found >= 0])
