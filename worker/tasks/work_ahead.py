"""Working on what comes next while the database stores what came before.

For half of the time that a run on known detections takes, a worker would wait for a database
elsewhere. A thread reads and fuses the next batch meanwhile; what went wrong there is done again in
its turn, so that only a failure that lasts is told.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

Done = TypeVar("Done")
_THREADS = ThreadPoolExecutor(thread_name_prefix="ahead")


class WorkAhead(Generic[Done]):
    """Does stretches of one job's work, from one number to another below `end`, by `do`.

    `do` stores nothing, and gives the same whenever it is done.
    """

    def __init__(self, do: Callable[[int, int], Done], end: int) -> None:
        self._do = do
        self._end = end
        self._begun: dict[tuple[int, int], Future[Done]] = {}

    def begin(self, start: int, stop: int) -> None:
        """Begin with a stretch, if there is one; returns at once."""
        if start < self._end:
            self._begun[start, stop] = _THREADS.submit(self._do, start, stop)

    def take(self, start: int, stop: int) -> Done:
        """Return what comes of a stretch, done ahead or now."""
        begun = self._begun.pop((start, stop), None)
        if begun is None or begun.exception() is not None:
            return self._do(start, stop)
        return begun.result()

    def give_up(self) -> None:
        """Leave nothing behind that is still at work."""
        for begun in self._begun.values():
            if not begun.cancel():
                begun.exception()
        self._begun.clear()
