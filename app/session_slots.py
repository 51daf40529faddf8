"""How many requests may have a database session at once: fewer than there are connections.

A request holds its connection from its first statement to the end of its answer, and needs threads
in between. Were there more such requests than connections, those that hold one could wait for a
thread while all threads wait for a connection. So the wait is here, where it costs neither.
"""

import asyncio
from weakref import WeakKeyDictionary

from anyio import Semaphore


class SessionSlots:
    """So many slots for each event loop; a process that serves has one loop."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._by_loop: WeakKeyDictionary[asyncio.AbstractEventLoop, Semaphore] = WeakKeyDictionary()

    def here(self) -> Semaphore:
        """Return the slots of the running event loop."""
        loop = asyncio.get_running_loop()
        return self._by_loop.setdefault(loop, Semaphore(self._most))
