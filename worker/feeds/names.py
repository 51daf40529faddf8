"""What a feed's host name leads to, known in time although name servers may be slow or dead.

The system's look-up takes as long as it likes and cannot be stopped. So it runs in a thread of its
own, and who wants to connect waits for it only so long: a moment where an address is known already,
which is then used again. Whatever is used was judged when it was found, and is judged anew here; a
name that leads inside by now is refused, and what it led to before is forgotten.
"""

import threading
from collections.abc import Callable, Sequence

from app.addresses import (
    AddressError,
    Destination,
    UnansweredError,
    judge,
    resolve_all,
)

Found = Sequence[Destination]
LookUp = Callable[[str, int, Sequence[str]], Found]
KNOWN_WAIT_S = 1.0  # for news of a name whose address is known


class NamedPlace:
    """Where a feed's host and port are to be found now.

    `wait_s` bounds how long to wait for the name server when nothing is known yet.
    """

    def __init__(
        self,
        host: str,
        port: int,
        allowed_networks: Sequence[str],
        wait_s: float,
        look_up: LookUp = resolve_all,
    ) -> None:
        self._asked = (host, port, allowed_networks)
        self._wait_s = wait_s
        self._look_up = look_up
        self._known: Found = ()
        self._running: _LookUpThread | None = None

    def destination(self, attempt: int = 0) -> Destination:
        """Return an address to connect to: at each further attempt the next one of the name's.

        Raises as `resolve_all`, and UnansweredError when no answer came in time and none is known.
        """
        running = self._running or _LookUpThread(self._look_up, self._asked)
        running.join(min(KNOWN_WAIT_S, self._wait_s) if self._known else self._wait_s)
        self._running = running if running.is_alive() else None
        try:
            self._known = running.answer()
        except UnansweredError:
            if not self._known:
                raise
            judge([place.ip for place in self._known], self._asked[2])
        except AddressError:
            self._known = ()
            raise
        return self._known[attempt % len(self._known)]


class _LookUpThread(threading.Thread):
    """One look-up, begun at once; whoever waits for it may go away."""

    def __init__(self, look_up: LookUp, asked: tuple[str, int, Sequence[str]]) -> None:
        super().__init__(name=f"name {asked[0]}", daemon=True)
        self._job = (look_up, asked)
        self._answer: Found | AddressError = UnansweredError(
            f"the name server says nothing about {asked[0]}"
        )
        self.start()

    def run(self) -> None:
        look_up, asked = self._job
        try:
            self._answer = look_up(*asked)
        except AddressError as error:
            self._answer = error

    def answer(self) -> Found:
        """Return what was found so far. Raises what the look-up raised."""
        if isinstance(self._answer, AddressError):
            raise self._answer
        return self._answer
