"""So many requests at a time and no more: the rest is told at once to come again.

Requests that queue without an end help nobody: each takes memory, their callers give up and ask
again, and in the end everything is answered too late. So a bounded number is under way, of streams
that stay open (server-sent events) too, and the next is answered 503 with `Retry-After`. What tells
whether the process lives is always answered.
"""

import structlog
from prometheus_client import Gauge
from starlette.types import ASGIApp, Receive, Scope, Send

from app.errors import Unavailable

ALWAYS_ANSWERED = ("/healthz", "/readyz", "/metrics", "/static/")
STREAMS = "/events"
RETRY_AFTER_S = 2
_log = structlog.get_logger("quaymark.overload")
_under_way = Gauge("quaymark_requests_under_way", "Requests not answered yet", ["kind"])


class BoundedRequests:
    """ASGI middleware that lets so many requests of each kind in at a time."""

    def __init__(self, app: ASGIApp, *, requests: int, streams: int) -> None:
        self._app = app
        self._most = {"request": requests, "stream": streams}
        self._count = {"request": 0, "stream": 0}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Go on, or refuse."""
        if scope["type"] != "http" or scope["path"].startswith(ALWAYS_ANSWERED):
            await self._app(scope, receive, send)
            return
        kind = "stream" if scope["path"].endswith(STREAMS) else "request"
        if self._count[kind] >= self._most[kind]:
            _log.warning("overloaded", kind=kind, under_way=self._count[kind])
            raise Unavailable(
                "too much is asked at once; try again in a moment",
                headers={"Retry-After": str(RETRY_AFTER_S)},
            )
        self._step(kind, 1)
        try:
            await self._app(scope, receive, send)
        finally:
            self._step(kind, -1)

    def _step(self, kind: str, by: int) -> None:
        self._count[kind] += by
        _under_way.labels(kind).set(self._count[kind])
