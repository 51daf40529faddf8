"""One line of JSON for each request: its id, who, what, how it ended, how long it took.

The query string stays out of the log, and so do all headers: tokens, cookies and what people
search for belong to nobody who reads logs. The id goes back in `X-Request-ID`.
"""

import secrets
import time

import structlog
from prometheus_client import Counter, Histogram
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_log = structlog.get_logger("quaymark.access_log")
_requests = Counter("quaymark_requests", "Requests answered", ["method", "status"])
_seconds = Histogram("quaymark_request_seconds", "Time to the end of the answer")
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class AccessLog:
    """ASGI middleware that numbers requests, times them and writes the line."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Go on; write the line when the answer has ended."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request_id = secrets.token_hex(8)
        status = 500
        began_at_s = time.perf_counter()

        async def send_on(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["X-Request-ID"] = request_id
            await send(message)

        with structlog.contextvars.bound_contextvars(request_id=request_id):
            try:
                await self._app(scope, receive, send_on)
            finally:
                _write(scope, status, time.perf_counter() - began_at_s)


def _write(scope: Scope, status: int, taken_s: float) -> None:
    method = scope["method"] if scope["method"] in _METHODS else "other"
    _requests.labels(method, str(status)).inc()
    _seconds.observe(taken_s)
    access = scope.get("state", {}).get("access")
    _log.info(
        "request",
        method=method,
        path=scope["path"],
        status=status,
        ms=round(taken_s * 1000, 1),
        user_id=access.user_id if access else None,
    )
