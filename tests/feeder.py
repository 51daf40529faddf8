"""A receiver of AIS for tests: sends lines over TCP, cuts, goes away and comes back."""

import socket
import threading
from types import TracebackType
from typing import Self

from tests.factories.nmea_text import POSITION, encoded
from tests.worker_process import wait_until

FIRST_MMSI = 211_000_000


def position_lines(count: int, first: int = 0, tag: str = "") -> list[bytes]:
    """Return that many position reports, each of another vessel, by default without a time."""
    return [
        f"{tag}{encoded(POSITION, mmsi=FIRST_MMSI + number, second=60)[0]}\r\n".encode()
        for number in range(first, first + count)
    ]


def free_udp_port() -> int:
    """Return a UDP port that nobody listens on."""
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Feeder:
    """A TCP server on this machine to whose clients a test sends what it likes."""

    def __init__(self) -> None:
        self.port = 0
        self.accepted = 0
        self._clients: list[socket.socket] = []
        self.come_back()

    def come_back(self) -> None:
        """Listen, on the same port as before."""
        self._listener = socket.create_server(("127.0.0.1", self.port))
        self.port = int(self._listener.getsockname()[1])
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            self._clients.append(client)
            self.accepted += 1

    def wait_for_client(self, accepted: int = 1) -> None:
        """Wait until so many connections were made since the beginning."""
        wait_until(lambda: self.accepted >= accepted, what="the client")

    def send(self, *lines: bytes) -> None:
        """Send to the client that came last."""
        self._clients[-1].sendall(b"".join(lines))

    def cut(self) -> None:
        """Close all connections."""
        for client in self._clients:
            client.close()

    def go_away(self) -> None:
        """Close all connections and take no new ones."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.cut()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._listener.close()
        self.cut()
