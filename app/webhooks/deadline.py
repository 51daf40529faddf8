"""An end to a request as a whole: the client's own timeouts begin anew with every byte that comes.

A receiver that sends a letter of its answer's head now and then would keep a sender for hours.
"""

import socket
from contextlib import suppress
from threading import Lock, Timer
from types import TracebackType
from typing import Any, Self

_CONNECTED = frozenset({"connection.connect_tcp.complete", "connection.start_tls.complete"})


class Deadline:
    """Cuts the connection of a request after so many seconds; `trace` goes to the client."""

    def __init__(self, seconds: float) -> None:
        self.is_over = False
        self._socket: socket.socket | None = None
        self._lock = Lock()
        self._timer = Timer(seconds, self._cut)
        self._timer.daemon = True

    def __enter__(self) -> Self:
        """Begin to count."""
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Cut nothing any more."""
        self._timer.cancel()
        with self._lock:
            self._socket = None

    def trace(self, event: str, told: dict[str, Any]) -> None:
        """Note the connection, as httpcore's extension `trace` tells of it."""
        if event not in _CONNECTED:
            return
        with self._lock:
            self._socket = told["return_value"].get_extra_info("socket")
        if self.is_over:
            self._cut()

    def _cut(self) -> None:
        with self._lock:
            self.is_over = True
            if self._socket is not None:
                with suppress(OSError):  # it has ended by itself
                    # The plain one's: that of TLS would take the state away from under a read.
                    socket.socket.shutdown(self._socket, socket.SHUT_RDWR)
