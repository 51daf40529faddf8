"""The web process: uvicorn with our settings, refusing to start on a database that does not fit.

Told to stop, it takes no new connection, ends the streams, and lets requests under way finish. What
has not finished then is cut, its transaction with it, and the process ends in any case.
"""

import os
import socket
import threading

import uvicorn

from app import schema
from app.config import Settings
from app.db import Database
from app.errors import AppError
from app.garbage import set_startup_aside
from app.logs import configure_logs
from app.main import create_app
from app.operation.large_bodies import LargeBodies

GRACE_S = 20
KEEP_ALIVE_S = 75
LEAVES_WITHIN_S = 26.0  # an orchestrator kills after 30 s


class GracefulServer(uvicorn.Server):
    """A server that tells its streams to end, and ends itself even if a thread does not."""

    def __init__(self, config: uvicorn.Config, leaving: threading.Event) -> None:
        super().__init__(config)
        self._leaving = leaving

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Finish what is under way."""
        self._leaving.set()
        last_resort = threading.Timer(LEAVES_WITHIN_S, os._exit, (0,))
        last_resort.daemon = True
        last_resort.start()
        await super().shutdown(sockets)


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a socket bound to an address. Raises AppError naming the port when it is taken."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # With the protocol named, asyncio turns Nagle's algorithm off; without, a small answer on a
    # connection kept alive waits 40 ms for the caller's delayed acknowledgement.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        raise AppError(
            f"port {port} at {host} cannot be used ({error.strerror}); choose another with --port"
        ) from error
    return listener


def make_server(settings: Settings, *, quiet: bool = False) -> uvicorn.Server:
    """Build the web server. Raises Conflict when the database is not at this version."""
    database = Database(settings.database_url)
    try:
        schema.refuse_other_version(database)
    finally:
        database.dispose()
    app = create_app(settings)
    set_startup_aside()
    return GracefulServer(
        uvicorn.Config(
            app,
            http=LargeBodies,
            log_level="warning" if quiet else "info",
            access_log=False,
            server_header=False,
            # Beyond what we answer ourselves (app/auth/hosts.py), the server cuts the line.
            h11_max_incomplete_event_size=256 * 1024,
            timeout_graceful_shutdown=GRACE_S,
            # Longer than the minute for which proxies keep a connection to use it again.
            timeout_keep_alive=KEEP_ALIVE_S,
        ),
        app.state.leaving,
    )


def serve(settings: Settings, host: str, port: int) -> None:
    """Serve until SIGINT or SIGTERM."""
    configure_logs()
    server = make_server(settings)
    server.run(sockets=[listening_socket(host, port)])
