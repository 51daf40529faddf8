"""Security headers on every answer: a page runs our own files and nothing else.

The policy allows no inline script or style, no frame, no plugin, no other origin. An answer that
sets a stricter policy of its own (files of users are served with `sandbox`) keeps it.
"""

from secure import (
    ContentSecurityPolicy,
    CrossOriginOpenerPolicy,
    CrossOriginResourcePolicy,
    PermissionsPolicy,
    ReferrerPolicy,
    Secure,
    StrictTransportSecurity,
    XContentTypeOptions,
    XFrameOptions,
)
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

YEAR_S = 31_536_000


def content_security_policy(*tile_origins: str) -> ContentSecurityPolicy:
    """Return the policy of our own pages; map tiles may come from `tile_origins`."""
    return (
        ContentSecurityPolicy()
        .default_src("'none'")
        .script_src("'self'")
        .style_src("'self'")
        .img_src("'self'", "blob:", "data:", *tile_origins)
        .connect_src("'self'")
        .font_src("'self'")
        .form_action("'self'")
        .frame_ancestors("'none'")
        .base_uri("'none'")
    )


class SecurityHeaders:
    """ASGI middleware that adds the headers which an answer does not set itself."""

    def __init__(self, app: ASGIApp, *, https: bool, tile_origin: str | None) -> None:
        self._app = app
        self._headers = Secure(
            csp=content_security_policy(*filter(None, [tile_origin])),
            coop=CrossOriginOpenerPolicy().same_origin(),
            corp=CrossOriginResourcePolicy().same_origin(),
            hsts=StrictTransportSecurity().max_age(YEAR_S) if https else None,
            permissions=PermissionsPolicy().camera().microphone().geolocation().payment(),
            referrer=ReferrerPolicy().same_origin(),
            xcto=XContentTypeOptions().nosniff(),
            xfo=XFrameOptions().deny(),
        ).headers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Add the headers as the answer begins; pages and JSON are not kept by caches."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_on(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    headers.setdefault(name, value)
                headers.setdefault("Cache-Control", "no-store")
            await send(message)

        await self._app(scope, receive, send_on)
