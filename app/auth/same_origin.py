"""Cross-site request forgery: a browser's writing requests must come from our own pages.

Browsers attach the session cookie whoever wrote the form. They also say, in `Sec-Fetch-Site` and
`Origin`, which a page cannot forge, where the request comes from; so no secret in each form is
needed. A bearer token is sent on purpose and needs no such check; a client that sends neither
header is no browser of the last years and has no cookie that somebody else could make it send.
Signing in is checked too: being signed in to a stranger's account is a trap as well.
"""

from urllib.parse import urlsplit

import structlog
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from app.dependencies import SAFE_METHODS
from app.errors import Forbidden

_log = structlog.get_logger("quaymark.same_origin")


class SameOrigin:
    """ASGI middleware that refuses writing requests sent by other sites' pages."""

    def __init__(self, app: ASGIApp, public_url: str) -> None:
        self._app = app
        self._public_host = urlsplit(public_url).netloc.lower()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check, then go on."""
        if scope["type"] == "http" and scope["method"] not in SAFE_METHODS:
            headers = Headers(scope=scope)
            if "authorization" not in headers and not self._is_same_origin(headers):
                _log.warning("cross_site_request", path=scope["path"], method=scope["method"])
                raise Forbidden(
                    "this came from another site's page; write from Quaymark's own pages, "
                    "or with an API token"
                )
        await self._app(scope, receive, send)

    def _is_same_origin(self, headers: Headers) -> bool:
        site = headers.get("sec-fetch-site")
        if site is not None:
            return site in {"same-origin", "none"}
        origin = headers.get("origin")
        if origin is None:
            return True
        return urlsplit(origin).netloc.lower() in {
            headers.get("host", "").lower(),
            self._public_host,
        } - {""}
