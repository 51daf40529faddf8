"""Text answers made small for browsers that say they can read it: pages and JSON, not files.

Only whole answers of a moderate size: streams go out as they come, photographs and exports are
packed already and are asked for in parts, and what is huge would keep everybody waiting while it is
packed. Static files are packed as they are built (`app.statics`).

Packing beside a secret can give the secret away to whoever makes a browser send guesses that the
answer repeats (BREACH). Here no page holds a lasting secret: forgery is kept off by where a request
comes from and not by a token in the page, cookies do not travel with other sites' sub-requests, and
what is shown once is shown in answers to requests that only our own pages can send.
"""

import gzip

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

SMALLEST_BYTES, LARGEST_BYTES = 1024, 2**20
LEVEL = 4  # three times as quick as the usual 9, for a twentieth more bytes
TEXTS = ("text/html", "application/json", "application/problem+json", "application/geo+json")


class CompressTexts:
    """ASGI middleware that packs whole text answers with gzip."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Go on; hold the beginning of a text answer back until its body is known."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        is_taken = "gzip" in Headers(scope=scope).get("accept-encoding", "")
        held: Message | None = None

        async def send_on(message: Message) -> None:
            nonlocal held
            if message["type"] == "http.response.start" and _is_text(message):
                held = message
                return
            if held is not None:
                start, held = held, None
                if is_taken:
                    message = _packed(start, message)
                await send(start)
            await send(message)

        await self._app(scope, receive, send_on)


def _is_text(start: Message) -> bool:
    headers = MutableHeaders(scope=start)
    if not headers.get("content-type", "").startswith(TEXTS) or "content-encoding" in headers:
        return False
    headers.add_vary_header("Accept-Encoding")
    return True


def _packed(start: Message, message: Message) -> Message:
    body: bytes = message.get("body", b"")
    if message.get("more_body") or not SMALLEST_BYTES <= len(body) <= LARGEST_BYTES:
        return message
    small = gzip.compress(body, LEVEL, mtime=0)
    headers = MutableHeaders(scope=start)
    headers["Content-Encoding"] = "gzip"
    headers["Content-Length"] = str(len(small))
    return {**message, "body": small}
