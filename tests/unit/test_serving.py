"""The socket the web process listens at."""

import asyncio
import socket
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.errors import AppError
from app.operation.serving import listening_socket


def test_small_answers_leave_at_once() -> None:
    """A connection accepted on our socket does not hold small answers back (Nagle's algorithm)."""

    async def is_prompt() -> bool:
        listener = listening_socket("127.0.0.1", 0)
        accepted = asyncio.get_running_loop().create_future()

        def answer(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            connection = writer.get_extra_info("socket")
            accepted.set_result(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        server = await asyncio.start_server(answer, sock=listener)
        async with server:
            _, writer = await asyncio.open_connection(*listener.getsockname())
            nodelay = await accepted
            writer.close()
        return bool(nodelay)

    # A browser test before this one leaves an event loop running in the main thread.
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(lambda: asyncio.run(is_prompt())).result()


def test_a_port_that_is_taken_is_named() -> None:
    """The message says which port at which address, and what to do."""
    with listening_socket("127.0.0.1", 0) as first:
        first.listen()
        port = first.getsockname()[1]
        with pytest.raises(AppError, match=f"port {port} at 127.0.0.1 .* --port"):
            listening_socket("127.0.0.1", port)
