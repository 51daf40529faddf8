"""Where lines come from: a TCP connection that we open, or datagrams that are sent to us.

A source runs in a thread of its own, does nothing but receive, and never ends by itself. A link
that is refused, cut, or silent for too long is made anew after a pause that grows and is never the
same twice, so that a thousand clients of a server that comes back do not all knock at once. An
address is judged anew before each connection: what a name leads to may have changed.
"""

import random
import socket
import struct
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from ipaddress import ip_address, ip_network

import structlog

from app.addresses import AddressError, Destination, ForbiddenAddressError
from app.config import Settings
from app.db import now
from app.tables.feeds import FeedCondition
from worker.feeds.line_queue import LineCutter, LineQueue
from worker.feeds.link import Link
from worker.feeds.names import NamedPlace

log = structlog.get_logger()
FIRST_PAUSE_S = 0.5
LOOK_EVERY_S = 0.25  # whether to stop
CHUNK_BYTES = 1 << 16
MOST_LEFT_CHUNKS = 64
RECEIVE_BUFFER_BYTES = 4 << 20
SO_RXQ_OVFL = 40  # Linux: the kernel tells with each datagram how many it had no room for


class TcpSource:
    """Connects to a receiver or a server that sends lines."""

    def __init__(self, host: str, port: int, settings: Settings) -> None:
        self._settings = settings
        self._place = NamedPlace(
            host, port, settings.feed_allowed_networks, settings.feed_connect_timeout_s
        )

    def run(self, queue: LineQueue, link: Link, stop: threading.Event) -> None:
        """Receive until told to stop."""
        failures = 0
        while not stop.is_set():
            received = False
            try:
                destination = self._place.destination(attempt=failures)
                received = self._receive(destination, queue, link, stop)
            except ForbiddenAddressError as error:
                link.failed(f"The address {error}.", FeedCondition.REFUSED)
            except AddressError as error:
                link.failed(f"The address cannot be used: {error}.")
            except OSError as error:
                link.failed(_told(error))
            failures = 0 if received else failures + 1
            stop.wait(pause_s(failures, self._settings.feed_longest_retry_s))

    def _receive(
        self, destination: Destination, queue: LineQueue, link: Link, stop: threading.Event
    ) -> bool:
        """Receive over one connection until it ends; return whether anything came."""
        settings = self._settings
        cutter, received = LineCutter(), False
        with socket.create_connection(
            (destination.ip, destination.port), timeout=settings.feed_connect_timeout_s
        ) as connection:
            _probe_when_idle(connection)
            connection.settimeout(LOOK_EVERY_S)
            link.connected(str(destination))
            last_heard = time.monotonic()
            while not stop.is_set():
                try:
                    chunk = connection.recv(CHUNK_BYTES)
                except TimeoutError:
                    if time.monotonic() - last_heard > settings.feed_stall_s:
                        link.failed(
                            f"Nothing came for {settings.feed_stall_s:g} s, so the connection is "
                            "made anew."
                        )
                        break
                    continue
                except OSError as error:
                    link.failed(_told(error))
                    break
                if not chunk:
                    link.failed("The other side closed the connection.")
                    break
                last_heard, received = time.monotonic(), True
                queue.put(now(), list(cutter.push(chunk)))
            if stop.is_set():
                _take_what_is_there(connection, cutter, queue)
            queue.put(now(), list(cutter.end()))
        return received


class UdpSource:
    """Listens for datagrams, each with one line or a few."""

    def __init__(
        self, address: str, port: int, allowed_senders: Sequence[str], settings: Settings
    ) -> None:
        self._address = address
        self._port = port
        self._allowed = [ip_network(network) for network in allowed_senders]
        self._settings = settings

    def run(self, queue: LineQueue, link: Link, stop: threading.Event) -> None:
        """Receive until told to stop."""
        failures = 0
        while not stop.is_set():
            try:
                self._receive(queue, link, stop)
            except OSError as error:
                link.failed(_told(error))
            failures += 1
            stop.wait(pause_s(failures, self._settings.feed_longest_retry_s))

    def _receive(self, queue: LineQueue, link: Link, stop: threading.Event) -> None:
        family = socket.AF_INET6 if ":" in self._address else socket.AF_INET
        lost_before: int | None = None
        with socket.socket(family, socket.SOCK_DGRAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
            _ask_for_losses(listener)
            listener.bind((self._address, self._port))
            listener.settimeout(LOOK_EVERY_S)
            link.connected(f"port {self._port}")
            while not stop.is_set():
                try:
                    data, extra, _, sender = listener.recvmsg(CHUNK_BYTES, 64)
                except TimeoutError:
                    continue
                lost = _lost(extra)
                if lost is not None:
                    queue.drop(lost - (lost_before or 0))
                    lost_before = lost
                if not self._is_allowed(str(sender[0])):
                    link.count_foreign()
                    continue
                cutter = LineCutter()
                queue.put(now(), [*cutter.push(data), *cutter.end()])

    def _is_allowed(self, sender: str) -> bool:
        if not self._allowed:
            return True
        address = ip_address(sender.partition("%")[0])
        if address.version == 6 and address.ipv4_mapped:
            address = address.ipv4_mapped
        return any(address in network for network in self._allowed)


def pause_s(failures: int, longest_s: float) -> float:
    """Return how long to wait before the next try: doubling, and a little different each time."""
    longest = min(longest_s, FIRST_PAUSE_S * 2.0 ** min(failures, 20))
    share: float = random.uniform(0.5, 1.0)  # noqa: S311  spreads tries, protects nothing
    return longest * share


def _take_what_is_there(connection: socket.socket, cutter: LineCutter, queue: LineQueue) -> None:
    """Receive what came before the feed was told to stop, and nothing after it."""
    connection.setblocking(False)
    with suppress(OSError):  # nothing is left
        for _ in range(MOST_LEFT_CHUNKS):
            queue.put(now(), list(cutter.push(connection.recv(CHUNK_BYTES))))


def _probe_when_idle(connection: socket.socket) -> None:
    """Have the kernel find out within half a minute that the other side is gone without a word."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (("TCP_KEEPIDLE", 10), ("TCP_KEEPINTVL", 5), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, name):  # not on every system
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def _ask_for_losses(listener: socket.socket) -> None:
    try:
        listener.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    except OSError:
        log.info("this system does not tell how many datagrams it had no room for")


def _lost(extra: list[tuple[int, int, bytes]]) -> int | None:
    """Return how many datagrams the kernel had no room for since the socket was opened."""
    for level, kind, data in extra:
        if level == socket.SOL_SOCKET and kind == SO_RXQ_OVFL:
            (lost,) = struct.unpack("I", data[:4])
            return int(lost)
    return None


def _told(error: OSError) -> str:
    """Return what went wrong with a socket in plain words."""
    match error:
        case ConnectionRefusedError():
            return "Nobody answers at this address and port."
        case ConnectionError():
            return "The connection was cut."
        case TimeoutError():
            return "No answer from this address in time."
    return f"{error.strerror or error}."
