"""Figures that are kept by the content they follow from, the newest of them in memory."""

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from typing import Generic, TypeVar

Figures = TypeVar("Figures")


class Kept(Generic[Figures]):
    """The figures worked out last. A key says all that they follow from, so none grows stale."""

    def __init__(self, most: int = 64) -> None:
        self._most = most
        self._figures: OrderedDict[str, Figures] = OrderedDict()
        self._lock = Lock()

    def get(self, key: str, work_out: Callable[[], Figures]) -> Figures:
        """Return the figures of a key; two callers at once may both work them out."""
        with self._lock:
            if key in self._figures:
                self._figures.move_to_end(key)
                return self._figures[key]
        figures = work_out()
        with self._lock:
            self._figures[key] = figures
            while len(self._figures) > self._most:
                self._figures.popitem(last=False)
        return figures
