"""Which class a network's label means: COCO counts its 80 classes in two ways.

The published ids run from 1 to 90 with ten of them unused, so boat is 9; most networks count what
is left from 0, so boat is 8. Class ids here are always the latter, or a model's own if it names
its classes: settings then mean the same for every detector.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.detection import COCO_BOAT

COCO_CLASSES = 80
COCO_IDS = 91
"""One more than the largest published id."""

_UNUSED_IDS = (0, 12, 26, 29, 30, 45, 66, 68, 69, 71, 83)
_COCO_BOAT_ID = 9
NO_CLASS = -1

Labels = npt.NDArray[np.int64]


def _by_coco_id() -> Labels:
    classes = np.full(COCO_IDS, NO_CLASS, dtype=np.int64)
    used = np.setdiff1d(np.arange(COCO_IDS), _UNUSED_IDS)
    classes[used] = np.arange(len(used))
    return classes


_CLASS_OF_COCO_ID = _by_coco_id()


@dataclass(frozen=True, slots=True)
class ClassNumbers:
    """The labels a network gives: how many (None: not known), their names, and what they count.

    `are_coco_ids`: labels are COCO's published ids; else they are class ids as they stand.
    """

    count: int | None
    names: tuple[str, ...] | None = None
    are_coco_ids: bool = False

    def class_ids(self, labels: npt.NDArray[np.generic]) -> Labels:
        """Return the class ids of labels; -1 for one that means nothing."""
        numbers = labels.astype(np.int64)
        limit = COCO_IDS if self.are_coco_ids else self.count
        known = numbers >= 0
        if limit is not None:
            known &= numbers < limit
        numbers = np.where(known, numbers, 0)
        classes = _CLASS_OF_COCO_ID[numbers] if self.are_coco_ids else numbers
        return np.where(known, classes, NO_CLASS)

    def unknown(self, class_ids: Sequence[int]) -> int | None:
        """Return the first class id that the network never gives; None if it may give all."""
        limit = COCO_CLASSES if self.are_coco_ids else self.count
        if limit is None:
            return None
        return next((class_id for class_id in class_ids if class_id >= limit), None)


def numbers_of(
    count: int | None, names: tuple[str, ...] | None, *, ids_by_default: bool = False
) -> ClassNumbers:
    """Return what labels mean, from their number and their names; either may be unknown.

    Without both, `ids_by_default` says whether they are COCO's published ids. Raises ValueError
    when they are neither named nor COCO's.
    """
    if names is not None:
        is_coco = len(names) == COCO_IDS and names[_COCO_BOAT_ID].strip().lower() == "boat"
        return ClassNumbers(len(names), names, are_coco_ids=is_coco)
    if count is None:
        return ClassNumbers(None, are_coco_ids=ids_by_default)
    if count in {COCO_IDS, COCO_IDS - 1}:
        return ClassNumbers(count, are_coco_ids=True)
    if count <= COCO_BOAT:
        raise ValueError(
            f"the model tells {count} classes apart and does not name them: expected are COCO's "
            f"80 (class {COCO_BOAT} is boat), or a list 'class_names' in the model's metadata"
        )
    return ClassNumbers(count)
