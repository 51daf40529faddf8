"""Reading what comes next while what was read before is worked on.

Half of the time that reading takes, a worker waits for its database. A thread reads the next batch
meanwhile; what it could not read is read again in its turn, so that only a failure that lasts is
told.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

Read = TypeVar("Read")
_READERS = ThreadPoolExecutor(thread_name_prefix="read")


class ReadAhead(Generic[Read]):
    """Reads stretches of one job's work, from one number to another below `end`, by `read`."""

    def __init__(self, read: Callable[[int, int], Read], end: int) -> None:
        self._read = read
        self._end = end
        self._begun: dict[tuple[int, int], Future[Read]] = {}

    def begin(self, start: int, stop: int) -> None:
        """Begin to read a stretch, if there is one; returns at once."""
        if start < self._end:
            self._begun[start, stop] = _READERS.submit(self._read, start, stop)

    def take(self, start: int, stop: int) -> Read:
        """Return what stands in a stretch, read ahead or now."""
        begun = self._begun.pop((start, stop), None)
        if begun is None or begun.exception() is not None:
            return self._read(start, stop)
        return begun.result()

    def give_up(self) -> None:
        """Leave nothing behind that still reads."""
        for begun in self._begun.values():
            if not begun.cancel():
                begun.exception()
        self._begun.clear()
