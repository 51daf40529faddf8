"""A request's headers before anybody trusts them: the Host is one of ours, the rest is of a size.

Frameworks build absolute addresses from Host. One such as `a/?x=` moves the path into the query,
and checks of the path then look at something else than the route does.
"""

import re
from collections.abc import Sequence

from starlette.types import ASGIApp, Receive, Scope, Send

from app.errors import AppError, BadRequest

MOST_HEADERS = 100
MOST_HEADER_BYTES = 160 * 1024  # so that a Range of ten thousand parts gets its own answer
_HOST = re.compile(r"(?P<name>[A-Za-z0-9._-]{1,253}|\[[0-9A-Fa-f:.]{2,45}\])(?::[0-9]{1,5})?")


class HeadersTooLarge(AppError):  # noqa: N818  named like the other answers
    """431: more header than any honest client sends."""

    status = 431
    title = "Headers too large"


class HeaderChecks:
    """ASGI middleware that refuses a malformed or foreign Host and oversized headers."""

    def __init__(self, app: ASGIApp, allowed_hosts: Sequence[str]) -> None:
        self._app = app
        self._allowed = frozenset(host.lower() for host in allowed_hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check, then go on."""
        if scope["type"] == "http":
            headers: list[tuple[bytes, bytes]] = scope["headers"]
            size_bytes = sum(len(name) + len(value) for name, value in headers)
            if len(headers) > MOST_HEADERS or size_bytes > MOST_HEADER_BYTES:
                raise HeadersTooLarge(
                    f"send at most {MOST_HEADERS} headers of {MOST_HEADER_BYTES} bytes together"
                )
            self._check_host([value for name, value in headers if name == b"host"])
        await self._app(scope, receive, send)

    def _check_host(self, values: list[bytes]) -> None:
        if len(values) != 1:
            raise BadRequest("send exactly one Host header")
        match = _HOST.fullmatch(values[0].decode("latin-1"))
        if match is None:
            raise BadRequest("the Host header is malformed; send a name or address and a port")
        if "*" not in self._allowed and match["name"].lower() not in self._allowed:
            raise BadRequest("this installation does not answer to that Host; see allowed_hosts")
